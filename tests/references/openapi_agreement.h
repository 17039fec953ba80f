#pragma once

#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "api/chart_request.h"
#include "api/composite_request.h"
#include "api/contract_schema.h"
#include "api/measurement_request.h"
#include "api/optics_request.h"
#include "api/problem.h"
#include "api/psf_request.h"
#include "api/render_request.h"
#include "api/sweep_request.h"

namespace fstop::api {

using nlohmann::json;

inline std::string file_text(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

/// A kind of request, and the schema of its name.
enum class Kind { render, optics, psf, chart, measurement, sweep, composite };

inline std::string schema_of(Kind kind) {
  switch (kind) {
    case Kind::render:
      return "RenderRequest";
    case Kind::optics:
      return "OpticsRequest";
    case Kind::psf:
      return "PsfRequest";
    case Kind::chart:
      return "ChartRequest";
    case Kind::measurement:
      return "MeasurementRequest";
    case Kind::sweep:
      return "SweepRequest";
    case Kind::composite:
      return "CompositeRequest";
  }
  return {};
}

inline Kind kind_of_file(const std::string& name) {
  if (name.starts_with("optics")) return Kind::optics;
  if (name.starts_with("chart")) return Kind::chart;
  if (name.starts_with("sweep")) return Kind::sweep;
  if (name.starts_with("composite")) return Kind::composite;
  if (name.starts_with("measurements")) return Kind::measurement;
  return name.starts_with("psf") ? Kind::psf : Kind::render;
}

inline bool parses(const json& request, Kind kind) {
  try {
    switch (kind) {
      case Kind::render:
        parse_render_request(request.dump(), Limits{}, SceneNames::stored_only);
        break;
      case Kind::optics:
        parse_optics_request(request.dump(), Limits{});
        break;
      case Kind::psf:
        parse_psf_request(request.dump(), Limits{});
        break;
      case Kind::chart:
        parse_chart_request(request.dump(), Limits{}, SceneNames::stored_only);
        break;
      case Kind::measurement:
        parse_measurement_request(request.dump(), Limits{});
        break;
      case Kind::sweep:
        parse_sweep_request(request.dump(), Limits{}, SceneNames::stored_only);
        break;
      case Kind::composite:
        parse_composite_request(request.dump(), Limits{}, SceneNames::stored_only);
        break;
    }
    return true;
  } catch (const InvalidRequest&) {
    return false;
  }
}

/// One member of a request set to one value, and what schema and parser both say of it.
struct Mutation {
  std::string pointer = {};
  std::string value = {};
  bool legal = false;
};

inline void expect_agreement(const json& original, Kind kind,
                             const std::vector<Mutation>& mutations) {
  const ContractSchema schema(schema_of(kind));
  for (const Mutation& mutation : mutations) {
    json request = original;
    request[json::json_pointer(mutation.pointer)] = json::parse(mutation.value);
    const std::string label = mutation.pointer + " = " + mutation.value;
    EXPECT_EQ(schema.objection(request).empty(), mutation.legal) << "schema: " << label;
    EXPECT_EQ(parses(request, kind), mutation.legal) << "parser: " << label;
  }
}

}  // namespace fstop::api
