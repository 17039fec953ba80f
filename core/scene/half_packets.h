#pragma once

#include <embree3/rtcore.h>

#include "core/scene/ray_packet.h"

namespace fstop {

/// What rtcIntersect16 and rtcOccluded16 do, by two packets of 8: for machines without AVX-512.
void intersect_halves(RTCScene scene, RTCIntersectContext& context, const LaneMask& valid,
                      RayPacket& packet) noexcept;
void occlude_halves(RTCScene scene, RTCIntersectContext& context, const LaneMask& valid,
                    RayPacket& packet) noexcept;

}  // namespace fstop
