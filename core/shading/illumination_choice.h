#pragma once

namespace fstop {

/// Which light a surface sends on beside its own emission.
enum class Illumination {
  local,      ///< that of the scene's lights; mirrors and glass show nothing
  recursive,  ///< and what mirrors, glass and sheets show (Whitted 1980)
  global,     ///< and what all other surfaces send to its diffuse colour (Kajiya 1986)
};

}  // namespace fstop
