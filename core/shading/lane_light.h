#pragma once

#include "core/sampling/sequence.h"
#include "core/scene/lane_colors.h"
#include "core/scene/lane_surfaces.h"

namespace fstop {

/// The lanes of a packet that answer to lights, and how.
struct alignas(64) LitLanes {
  LaneMask mask = {};
  LaneColors diffuse = {};  // black in other lanes
  LaneColors specular = {};
  LaneFloats shininess = {};
  LaneMask blinn = {};  // all bits set where the half vector is meant
  bool any = false;
  bool any_specular = false;
  bool any_gouraud = false;
};

/// One light as every lane receives it, before shadows: `IncidentLight` lane by lane.
struct alignas(64) LaneLight {
  // Not initialised: incident_light fills all.
  LaneFloats x, y, z;   // to the light, unit
  LaneFloats distance;  // metres; infinite for a directional light
  LaneFloats factor;    // f_radial f_angular
};

/// ReflectionTerms lane by lane.
struct alignas(64) LaneTerms {
  // Not initialised: reflection_terms fills both.
  LaneFloats diffuse;
  LaneFloats specular;
};

/// `light` at every surface; `u`, `v` in [0, 1) choose the point of an area light.
void incident_light(const Light& light, const LaneSurfaces& surfaces, const LaneValues& u,
                    const LaneValues& v, LaneLight& result) noexcept;

/// Phong's and Blinn's factors of every lit lane (see reflection_terms), viewed along the
/// packet's rays.
void reflection_terms(const LitLanes& lit, const LaneSurfaces& surfaces, const RayPacket& packet,
                      const LaneLight& light, LaneTerms& terms) noexcept;

/// What every lane would get of the light if nothing stood between, and the rays that ask whether
/// something does: `asked` is set where the share is not zero.
void cast_shadow_rays(const LitLanes& lit, const LaneSurfaces& surfaces, const RayPacket& packet,
                      const LaneLight& light, const LaneTerms& terms, const Rgb& intensity,
                      LaneColors& share, RayPacket& shadow, LaneMask& asked) noexcept;

}  // namespace fstop
