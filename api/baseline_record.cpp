#include "api/baseline_record.h"

#include "api/json_reader.h"
#include "api/json_text.h"
#include "api/json_writer.h"
#include "api/render_id.h"
#include "core/encode/image_codec.h"
#include "core/error.h"

namespace fstop::api {
namespace {

using nlohmann::json;

constexpr std::size_t kTextBytes = 4096;
constexpr std::size_t kMostAcceptances = 10'000;
constexpr std::size_t kRequestBytes = std::size_t{8} << 20U;
constexpr Range kAnyNumber{-1e300, 1e300};

Json three(const std::array<double, 3>& values) {
  return {number_json(values[0]), number_json(values[1]), number_json(values[2])};
}

Json change_json(const std::optional<BaselineChange>& change) {
  if (!change) return nullptr;
  return {{"rmse", number_json(change->rmse)},
          {"largest_deviation", number_json(change->largest_deviation)},
          {"brightness", three(change->brightness)}};
}

BaselineAcceptance read_acceptance(ObjectReader& reader) {
  BaselineAcceptance acceptance{.who = reader.text("who", kTextBytes),
                                .why = reader.text("why", kTextBytes),
                                .engine = reader.text("engine", kTextBytes)};
  if (const json* member = reader.value("change", false); member != nullptr && !member->is_null()) {
    ObjectReader change = reader.object("change");
    acceptance.change =
        BaselineChange{.rmse = change.number("rmse", kAnyNumber),
                       .largest_deviation = change.number("largest_deviation", kAnyNumber),
                       .brightness = change.triple("brightness", kAnyNumber, "")};
    change.reject_unread_members();
  }
  reader.reject_unread_members();
  return acceptance;
}

// The channel of that name anywhere in the picture, copied into channel `to` of `image`.
void copy_channel(const Picture& picture, const std::string& name, Image& image, int to) {
  for (const ImageLayer& layer : picture.layers) {
    for (std::size_t c = 0; c < layer.channel_names.size(); ++c) {
      if (layer.channel_names[c] != name) continue;
      if (image.empty()) image = Image(layer.image.width(), layer.image.height(), 3);
      for (int y = 0; y < image.height(); ++y) {
        for (int x = 0; x < image.width(); ++x) image.at(x, y)[to] = layer.image.at(x, y)[c];
      }
      return;
    }
  }
  throw Error(ErrorCode::bad_image, "the baseline's file has no channel " + name);
}

// The layer of a stem ("var."), or the colours for none.
Image layer_of(const Picture& picture, const std::string& stem) {
  Image image;
  for (int c = 0; c < 3; ++c) copy_channel(picture, stem + "RGB"[c], image, c);
  return image;
}

}  // namespace

std::string baseline_record_json(const BaselineRecord& record) {
  Json accepted = Json::array();
  for (const BaselineAcceptance& acceptance : record.accepted) {
    accepted.push_back({{"who", acceptance.who},
                        {"why", acceptance.why},
                        {"engine", acceptance.engine},
                        {"change", change_json(acceptance.change)}});
  }
  const Json value = {{"format", "fstop-baseline/1"},
                      {"image_sha256", record.image_sha256},
                      {"replicates", record.replicates},
                      {"total", three(record.total)},
                      {"total_variance", three(record.total_variance)},
                      {"accepted", std::move(accepted)},
                      {"request", Json::parse(record.request)}};
  return value.dump(2);
}

BaselineRecord parse_baseline_record(std::string_view text, const Limits& limits) {
  const json value = parse_json(text, limits);
  FaultList faults(limits.faults);
  json normal;
  ObjectReader root(value, "#", faults, normal);
  faults.throw_if_any();
  if (root.text("format", kTextBytes) != "fstop-baseline/1" && root.clean())
    root.fault("format", "must be \"fstop-baseline/1\"");
  BaselineRecord record{.image_sha256 = root.text("image_sha256", kTextBytes),
                        .replicates = static_cast<int>(root.integer("replicates", 2, 4096)),
                        .total = root.triple("total", kAnyNumber, ""),
                        .total_variance = root.triple("total_variance", kAnyNumber, "")};
  for (ObjectReader& reader : root.objects("accepted", kMostAcceptances)) {
    record.accepted.push_back(read_acceptance(reader));
  }
  if (const json* request = root.value("request", true)) record.request = json_text(*request);
  if (record.request.size() > kRequestBytes) root.fault("request", "is too long");
  root.reject_unread_members();
  faults.throw_if_any();
  return record;
}

std::vector<std::byte> baseline_file(const ImageBaseline& baseline) {
  return encode({.layers = {{{"R", "G", "B"}, baseline.mean},
                            {{"var.R", "var.G", "var.B"}, baseline.variance},
                            {{"block.R", "block.G", "block.B"}, baseline.block_variance}}},
                ImageFormat::exr);
}

ImageBaseline baseline_of(std::span<const std::byte> file, const BaselineRecord& record) {
  if (sha256_hex(file) != record.image_sha256) {
    throw Error(ErrorCode::bad_image,
                "the baseline's EXR file is not the one that its JSON file was written for");
  }
  const Picture picture = decode(file);
  return {.replicates = record.replicates,
          .mean = layer_of(picture, ""),
          .variance = layer_of(picture, "var."),
          .block_variance = layer_of(picture, "block."),
          .total = record.total,
          .total_variance = record.total_variance};
}

std::string request_with_seed(std::string_view normalised, std::uint32_t seed) {
  json request = json::parse(normalised);
  request["seed"] = seed;
  request["image"]["format"] = "exr";
  request["image"].erase("precision");
  return json_text(request);
}

std::uint32_t replicate_seed(std::uint32_t own, int replicate) {
  // An odd step: 2^32 different seeds before one comes again.
  return own + 0x9E3779B9U * (static_cast<std::uint32_t>(replicate) + 1U);
}

}  // namespace fstop::api
