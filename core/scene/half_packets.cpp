#include "core/scene/half_packets.h"

#include <algorithm>
#include <cstddef>
#include <cstring>

namespace fstop {
namespace {

constexpr std::size_t kHalf = kLanes / 2;
static_assert(sizeof(RTCRay8) * 2 == sizeof(RTCRay16) && sizeof(RTCHit8) * 2 == sizeof(RTCHit16));

// A packet is rows of kLanes numbers of four bytes each, in the order of Embree's: half of a packet
// has the same rows of half the length.
using Row = std::array<std::uint32_t, kLanes>;
using HalfRow = std::array<std::uint32_t, kHalf>;
constexpr std::size_t kRayRows = sizeof(RTCRay16) / sizeof(Row);
constexpr std::size_t kHitRows = sizeof(RTCHit16) / sizeof(Row);

void copy_half(const RayPacket& packet, std::size_t half, std::size_t rows, void* to) {
  const auto* from = reinterpret_cast<const std::byte*>(&packet) + half * sizeof(HalfRow);
  for (std::size_t row = 0; row < rows; ++row) {
    std::memcpy(static_cast<std::byte*>(to) + row * sizeof(HalfRow), from + row * sizeof(Row),
                sizeof(HalfRow));
  }
}

// Rows [first, first + rows) back.
void return_half(const void* from, std::size_t half, std::size_t first, std::size_t rows,
                 RayPacket& packet) {
  auto* to = reinterpret_cast<std::byte*>(&packet) + half * sizeof(HalfRow);
  for (std::size_t row = first; row < first + rows; ++row) {
    std::memcpy(to + row * sizeof(Row), static_cast<const std::byte*>(from) + row * sizeof(HalfRow),
                sizeof(HalfRow));
  }
}

constexpr std::size_t kFarRow = offsetof(RayPacket, far) / sizeof(Row);

bool any(const std::int32_t* valid) {
  return std::any_of(valid, valid + kHalf, [](std::int32_t lane) { return lane != 0; });
}

}  // namespace

void intersect_halves(RTCScene scene, RTCIntersectContext& context, const LaneMask& valid,
                      RayPacket& packet) noexcept {
  for (std::size_t half = 0; half < 2; ++half) {
    alignas(32) std::array<std::int32_t, kHalf> lanes;
    std::copy_n(valid.begin() + half * kHalf, kHalf, lanes.begin());
    if (!any(lanes.data())) continue;
    RTCRayHit8 rays;
    copy_half(packet, half, kRayRows + kHitRows, &rays);
    rtcIntersect8(lanes.data(), scene, &context, &rays);
    return_half(&rays, half, kFarRow, 1, packet);
    return_half(&rays, half, kRayRows, kHitRows, packet);
  }
}

void occlude_halves(RTCScene scene, RTCIntersectContext& context, const LaneMask& valid,
                    RayPacket& packet) noexcept {
  for (std::size_t half = 0; half < 2; ++half) {
    alignas(32) std::array<std::int32_t, kHalf> lanes;
    std::copy_n(valid.begin() + half * kHalf, kHalf, lanes.begin());
    if (!any(lanes.data())) continue;
    RTCRay8 rays;
    copy_half(packet, half, kRayRows, &rays);
    rtcOccluded8(lanes.data(), scene, &context, &rays);
    return_half(&rays, half, kFarRow, 1, packet);
  }
}

}  // namespace fstop
