#include "api/job_json.h"

#include "api/json_text.h"
#include "api/json_writer.h"

namespace fstop::api {
namespace {

Json links_of(const JobView& view) {
  const std::string self = "/v1/jobs/" + view.job;
  Json links = {{"self", self}, {"events", self + "/events"}};
  const bool is_active = view.state == "queued" || view.state == "running";
  if (is_active && view.previews > 0)
    links["preview"] = self + "/preview?number=" + std::to_string(view.previews);
  if (view.is_sweep) {
    links["sweep"] = "/v1/sweeps/" + view.render;
    if (view.state == "done") links["manifest"] = "/v1/sweeps/" + view.render + "/manifest";
    return links;
  }
  if (view.state != "done") return links;
  links["image"] = self + "/image";
  if (view.is_kept) links["render"] = "/v1/renders/" + view.render;
  return links;
}

}  // namespace

std::string job_json(const JobView& view) {
  Json value = {{"job", view.job}, {"state", view.state}};
  value[view.is_sweep ? "sweep" : "render"] = view.render;
  if (view.state == "queued") value["queue_place"] = view.queue_place;
  value["fraction"] = number_json(view.fraction);
  if (view.upper_95) value["upper_95"] = number_json(*view.upper_95);
  if (view.remaining_ms) value["remaining_ms"] = number_json(*view.remaining_ms);
  if (!view.waiting_for.empty()) value["waiting_for"] = view.waiting_for;
  value["links"] = links_of(view);
  if (!view.problem.empty()) value["problem"] = Json::parse(view.problem);
  return json_text(value);
}

std::string sweep_json(const SweepView& view) {
  const std::string self = "/v1/sweeps/" + view.sweep;
  Json value = {{"sweep", view.sweep},
                {"state", view.state},
                {"cells", view.cells},
                {"done", view.done},
                {"failed", view.failed}};
  if (!view.waiting_for.empty()) value["waiting_for"] = view.waiting_for;
  value["links"] = {{"self", self}};
  if (view.is_done) value["links"]["manifest"] = self + "/manifest";
  return json_text(value);
}

std::string limits_json(const Limits& limits, double backlog_s) {
  const auto seconds = [](std::chrono::milliseconds time) {
    return static_cast<double>(time.count()) / 1e3;
  };
  const Json value = {{"body_bytes", limits.body_bytes},
                      {"json_depth", limits.json_depth},
                      {"image_side_px", limits.image_side},
                      {"image_pixels", limits.image_pixels},
                      {"samples_per_pixel", limits.samples_per_pixel},
                      {"samples", limits.samples},
                      {"render_s", seconds(limits.render_time)},
                      {"render_bytes", limits.render_bytes},
                      {"synchronous_s", seconds(limits.synchronous_wait)},
                      {"longest_wait_s", seconds(limits.longest_wait)},
                      {"job_retention_s", seconds(limits.job_retention)},
                      {"concurrent_renders", limits.concurrent_renders},
                      {"queued_renders", limits.queued_renders},
                      {"queued_renders_per_client", limits.queued_per_client},
                      {"scene",
                       {{"bytes", limits.scene_file_bytes},
                        {"triangles", limits.scene_triangles},
                        {"texture_pixels", limits.scene_texture_pixels},
                        {"textures", limits.scene_textures},
                        {"objects", limits.scene_objects},
                        {"lights", limits.scene_lights}}},
                      {"sweep",
                       {{"cells", limits.sweep_cells},
                        {"axes", limits.sweep_axes},
                        {"request_bytes", limits.sweep_bytes},
                        {"predicted_s", seconds(limits.sweep_time)},
                        {"queued", limits.queued_sweeps}}},
                      {"composite_layers", limits.composite_layers},
                      {"backlog_s", number_json(backlog_s)}};
  return json_text(value);
}

}  // namespace fstop::api
