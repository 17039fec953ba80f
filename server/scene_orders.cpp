#include "server/scene_orders.h"

#include <string_view>
#include <variant>

#include "api/render_request.h"
#include "core/error.h"

namespace fstop::server {

SceneOrder SceneOrders::of(const SweepCell& cell) {
  const api::RenderRequest request =
      api::parse_render_request(cell.request, limits_, api::SceneNames::stored_or_files);
  const auto* name = std::get_if<std::string>(&request.scene);
  if (name == nullptr) return {};
  if (api::names_a_file(*name)) {
    throw Error(ErrorCode::unsupported,
                "workers elsewhere do not have scene file " + *name +
                    ": put it into a folder of its name under --scenes-dir, as scene.json");
  }
  const std::lock_guard lock(mutex_);
  if (const auto known = by_name_.find(*name); known != by_name_.end()) return known->second;
  SceneOrder order{.hash = scenes_.load(request).hash};
  for (const api::AssetBytes& file : scenes_.files(*name)) {
    const std::string_view bytes(reinterpret_cast<const char*>(file.bytes.data()),
                                 file.bytes.size());
    order.files.push_back({.name = file.name, .sha256 = store_.put(bytes), .bytes = bytes.size()});
  }
  return by_name_.emplace(*name, std::move(order)).first->second;
}

}  // namespace fstop::server
