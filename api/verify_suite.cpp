#include "api/verify_suite.h"

#include <algorithm>
#include <map>
#include <set>

#include "api/json_reader.h"
#include "api/json_text.h"
#include "api/simulation_json.h"
#include "core/error.h"

namespace fstop::api {
namespace {

using nlohmann::json;

constexpr std::size_t kNameBytes = 200;
constexpr std::size_t kMostCameras = 100;
constexpr std::size_t kMostChecks = 1000;
constexpr std::size_t kMostValues = 64;     // of one list
constexpr std::size_t kMostResults = 4096;  // of one check

constexpr Named<VerificationKind> kKinds[] = {
    {"blur", VerificationKind::blur},
    {"depth-of-field", VerificationKind::depth_of_field},
    {"brightness", VerificationKind::brightness},
    {"breathing", VerificationKind::breathing},
    {"defocus-mtf", VerificationKind::defocus_mtf},
    {"diffraction-mtf", VerificationKind::diffraction_mtf},
    {"pinhole-optimum", VerificationKind::pinhole_optimum},
    {"bokeh-shape", VerificationKind::bokeh_shape},
    {"focus-peak", VerificationKind::focus_peak}};
constexpr Named<std::string_view> kMethods[] = {{"auto", "auto"},
                                                {"lens-sampling", "lens-sampling"},
                                                {"lens-reconstruction", "lens-reconstruction"},
                                                {"gather", "gather"},
                                                {"wave", "wave"}};

class CheckReader {
 public:
  CheckReader(ObjectReader& reader, const std::map<std::string, CameraSpec>& cameras,
              const Limits& limits)
      : reader_(reader), cameras_(cameras), limits_(limits) {}

  VerificationCheck read() {
    check_.name = reader_.text("name", kNameBytes);
    check_.kind = reader_.choice<VerificationKind>("kind", kKinds);
    read_camera_name();
    if (!reader_.clean()) return check_;  // which members belong here is unknown
    read_lists();
    if (reader_.has("method"))
      check_.method = reader_.choice<std::string_view>("method", kMethods, "auto");
    check_.samples = static_cast<int>(reader_.integer("samples", 0, limits_.samples_per_pixel, 0));
    read_expected();
    reader_.reject_unread_members();
    return check_;
  }

 private:
  bool is_one_of(std::initializer_list<VerificationKind> kinds) const {
    return std::ranges::count(kinds, check_.kind) > 0;
  }

  void read_camera_name() {
    check_.camera_name = reader_.text("camera", kNameBytes);
    if (!reader_.clean()) return;
    const auto found = cameras_.find(check_.camera_name);
    if (found == cameras_.end())
      return reader_.fault("camera",
                           "names no camera of this suite: " + shortened(check_.camera_name, 64));
    check_.camera = found->second;
    const bool needs_pinhole = check_.kind == VerificationKind::pinhole_optimum;
    if (std::holds_alternative<PinholeSpec>(check_.camera.optics) != needs_pinhole) {
      reader_.fault("camera", needs_pinhole ? "must have a pinhole for this kind of check"
                                            : "must have a lens for this kind of check");
    } else if (check_.kind == VerificationKind::brightness && !check_.camera.exposure) {
      reader_.fault("camera", "must have an exposure with an iso for this kind of check");
    }
  }

  void read_lists() {
    using enum VerificationKind;
    if (is_one_of({blur, breathing})) {
      check_.focus_distances =
          reader_.lengths("focus_distances_m", 0.01_m, Length::si(1e6), kMostValues);
      for (const Length focus : check_.focus_distances) {
        if (const auto* lens = std::get_if<LensSpec>(&check_.camera.optics);
            lens != nullptr && focus <= lens->lens.focal_length) {
          reader_.fault("focus_distances_m", "must each exceed the camera's focal length");
        }
      }
    }
    if (is_one_of({blur, brightness, diffraction_mtf}))
      check_.f_numbers = reader_.numbers("f_numbers", {0.5, 256.0}, kMostValues, {});
    if (is_one_of({blur, defocus_mtf, pinhole_optimum, bokeh_shape, focus_peak})) {
      check_.object_distances =
          reader_.lengths("object_distances_m", 0.001_m, Length::si(1e6), kMostValues);
      if (check_.object_distances.empty())
        reader_.fault("object_distances_m", "needs a distance or more");
    }
    if (is_one_of({pinhole_optimum})) {
      check_.diameters = reader_.lengths("diameters_mm", 0.001_mm, 100.0_mm, kMostValues);
      if (check_.diameters.size() < 4) reader_.fault("diameters_mm", "needs four or more");
      if (check_.object_distances.size() > 1)
        reader_.fault("object_distances_m", "must be one distance for this kind of check");
    }
    if (is_one_of({bokeh_shape})) {
      for (const std::int64_t count : reader_.integers("blades", 3, 64, kMostValues, {})) {
        check_.blades.push_back(static_cast<int>(count));
      }
      if (check_.blades.empty()) reader_.fault("blades", "needs a number of blades or more");
    }
    if (is_one_of({depth_of_field}))
      check_.coc_limit = reader_.length("coc_limit_mm", 0.0001_mm, 100.0_mm, 0.03_mm);
  }

  void read_expected() {
    check_.further_tolerance =
        0.01 * reader_.number("expected_tolerance_percent", {0.0, 100.0}, 0.0);
    const json* list = reader_.value("expected", false);
    if (list == nullptr) return;
    if (!list->is_array() || list->size() > kMostResults)
      return reader_.fault("expected", "must be a list of at most " + std::to_string(kMostResults) +
                                           " numbers or nulls, one for each result");
    for (std::size_t i = 0; i < list->size(); ++i) {
      const json& value = (*list)[i];
      if (value.is_null()) {
        check_.expected.emplace_back();
      } else if (value.is_number()) {
        check_.expected.emplace_back(value.get<double>());
      } else {
        reader_.fault_at(reader_.pointer("expected") + "/" + std::to_string(i),
                         "must be a number, or null for the closed form");
      }
    }
  }

  ObjectReader& reader_;
  const std::map<std::string, CameraSpec>& cameras_;
  const Limits& limits_;
  VerificationCheck check_ = {};
};

}  // namespace

VerifySuite parse_verify_suite(std::string_view text, const Limits& limits) {
  const json value = parse_json(text, limits);
  FaultList faults(limits.faults);
  json normal;
  ObjectReader root(value, "#", faults, normal);
  faults.throw_if_any();
  if (root.text("format", kNameBytes) != "fstop-suite/1" && root.clean())
    root.fault("format", "must be \"fstop-suite/1\"");
  VerifySuite suite;
  suite.title = root.text("title", kNameBytes, "Optics");
  std::map<std::string, CameraSpec> cameras;
  for (auto& [name, reader] : root.named_objects("cameras", kMostCameras)) {
    cameras[name] = read_camera(reader);
  }
  std::set<std::string> names;
  for (ObjectReader& reader : root.objects("checks", kMostChecks)) {
    suite.checks.push_back(CheckReader(reader, cameras, limits).read());
    if (reader.clean() && !names.insert(suite.checks.back().name).second)
      reader.fault("name", "is that of another check");
  }
  if (root.clean() && suite.checks.empty()) root.fault("checks", "needs a check or more");
  root.reject_unread_members();
  faults.throw_if_any();
  return suite;
}

}  // namespace fstop::api
