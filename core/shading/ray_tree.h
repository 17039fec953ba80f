#pragma once

#include "core/shading/illumination.h"

namespace fstop {

/// Branches that add at most this much to a pixel are not followed: less than a quarter of a step
/// of an 8-bit image. They may show the brightest surface (brightest_value).
inline constexpr float kSmallestBranch = 0.001F;
inline constexpr int kDeepestBranch = 64;
/// Rays of one sample's tree: where mirrors and glass double the branches at every surface.
inline constexpr int kMostBranches = 4096;
/// Behind a diffuse bounce branches of this weight are followed for certain, lighter ones as rarely
/// as they are light.
inline constexpr float kCertainBranch = 0.25F;

/// Where the picture is traced, what was cut is measured instead (BlockTracer::cut_squares).
///
/// Largest error that cutting branches leaves in a sample whose further light is at most
/// `brightest`, in pixel values up to 1: the larger of kSmallestBranch and of what the heaviest
/// path shows at kDeepestBranch. Holds for paths that do not fork; `forks` tells whether some
/// material reflects and transmits both. Local illumination, which follows none, leaves out all
/// that a surface mirrors and transmits; with global illumination diffuse colours weigh as mirrors
/// do, of textures as if they were white.
struct BranchBound {
  double error = 0.0;
  bool forks = false;
};
BranchBound branch_bound(const std::vector<Material>& materials,
                         Illumination illumination = Illumination::recursive,
                         double brightest = 1.0);

/// Rays that a point of the scene may take: one to it and one to each light, and as many again for
/// each branch of the light that its heaviest material forks into; at most some thousands.
double most_rays_of_a_point(const Scene& scene);

/// Pixel value of the brightest thing that shines by itself, emitting surfaces and background, at
/// least white; `exposure` is the factor from radiance. What is lit may be brighter.
float brightest_value(const RayScene& scene, double exposure) noexcept;

/// Radiance along every valid lane of a traced packet: local light plus mirrored, refracted and
/// straight-through light, recursively (Whitted 1980):
///
///     with ior:  local + reflection I_reflected + transmission I_refracted
///     without:   (1 - transmission) (local + reflection I_reflected) + transmission I_behind
///
/// With `fresnel`, reflection is multiplied by the reflectance R and transmission by 1 - R. Where
/// Snell's law has no solution the transmitted share takes the mirror direction. With an exponent
/// I_reflected or I_refracted is the mean over a lobe about that direction, one ray a sample (Cook
/// et al. 1984).
///
/// Local illumination follows no branch: what it would bring is black. With global illumination
/// light that other surfaces and the background send joins local light, in place of ambient light:
///
///     diffuse * mean of I over directions with density cos/pi about the shading normal
///
/// one ray a sample, directions behind the face mirrored to its front; so for all it meets (Kajiya
/// 1986). Behind the first such ray branches lighter than kCertainBranch are followed by chance and
/// count as much more (Russian roulette, Arvo & Kirk 1990), so that only kDeepestBranch and
/// kMostBranches cut.
void shade(const ShadingInputs& in, const RayPacket& packet, const LaneMask& valid,
           LaneColors& colors, std::uint64_t& rays) noexcept;

/// Direction of a unit ray `incident` behind a surface of unit `normal` on the ray's side, with
/// `eta` the index on this side over the one beyond; false where reflection is total.
bool refracted(Vec3f incident, Vec3f normal, float eta, Vec3f& direction) noexcept;

/// Reflectance of a dielectric for unpolarised light: `cosine` >= 0 of the angle of incidence,
/// `eta` the index on this side over the one beyond. 1 where reflection is total. Source: Fresnel's
/// equations; Born & Wolf 1999, 1.5.2.
float fresnel_reflectance(float cosine, float eta) noexcept;

/// A unit direction about the unit `axis` with density (n+1)/(2 pi) cos^n, from u, v in [0, 1).
Vec3f lobe_direction(Vec3f axis, float exponent, float u, float v) noexcept;

/// `incident` mirrored at a surface of unit `normal`.
Vec3f mirrored(Vec3f incident, Vec3f normal) noexcept;

}  // namespace fstop
