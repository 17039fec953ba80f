#include "core/scene/mapping_check.h"

#include "core/error.h"
#include "core/scene/mapping.h"

namespace fstop {

bool gives_relief(const Material& material) noexcept {
  return material.bump.texture >= 0 || material.normal_map.texture >= 0;
}

void check_mapping(const Object& object, const Material& material) {
  if (maps_by_position(object.mapping)) SurfaceMap checked(object.mapping);
  if (!gives_relief(material)) return;
  if (std::holds_alternative<ScreenMapping>(object.mapping)) {
    throw Error(ErrorCode::bad_geometry,
                "material " + material.name +
                    " has relief, which a mapping on the screen gives no direction on a surface");
  }
  const auto* mesh = std::get_if<MeshObject>(&object.shape);
  const bool has_own = std::holds_alternative<OwnMapping>(object.mapping);
  if (has_own && mesh != nullptr && mesh->mesh.uvs.empty()) {
    throw Error(ErrorCode::bad_geometry, "mesh " + mesh->file +
                                             " has no texture coordinates, which the relief of "
                                             "material " +
                                             material.name + " needs");
  }
}

}  // namespace fstop
