#include "core/geometry.h"

#include <limits>

#include <gtest/gtest.h>

#include "core/error.h"

namespace fstop {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

// A dozen roundings of numbers of a few metres: 12 * 2^-53 * 4.
constexpr double kTolerance = 6e-15;

void expect_near(Vec3 actual, Vec3 expected) {
  EXPECT_NEAR(actual.x, expected.x, kTolerance);
  EXPECT_NEAR(actual.y, expected.y, kTolerance);
  EXPECT_NEAR(actual.z, expected.z, kTolerance);
}

ErrorCode refusal(Vec3 position, Vec3 target, Vec3 up) {
  try {
    Pose::looking_at(position, target, up);
  } catch (const Error& error) {
    return error.code();
  }
  ADD_FAILURE() << "not refused";
  return ErrorCode::internal;
}

TEST(Vectors, CrossProductIsRightHanded) {
  EXPECT_EQ(cross(Vec3{1, 0, 0}, Vec3{0, 1, 0}), (Vec3{0, 0, 1}));
  EXPECT_EQ(cross(Vec3{0, 1, 0}, Vec3{0, 0, 1}), (Vec3{1, 0, 0}));
  EXPECT_EQ(cross(Vec3f{1, 0, 0}, Vec3f{0, 1, 0}), (Vec3f{0, 0, 1}));
  EXPECT_EQ(cross(Vec3f{0, 1, 0}, Vec3f{0, 0, 1}), (Vec3f{1, 0, 0}));
}

// a x b is normal to both and |a x b|^2 = |a|^2 |b|^2 - (a.b)^2; whole numbers, so exact.
TEST(Vectors, CrossProductObeysLagrange) {
  const Vec3 a{2, -3, 5};
  const Vec3 b{-7, 1, 4};
  const Vec3 c = cross(a, b);
  EXPECT_EQ(dot(a, c), 0.0);
  EXPECT_EQ(dot(b, c), 0.0);
  EXPECT_EQ(dot(c, c), dot(a, a) * dot(b, b) - dot(a, b) * dot(a, b));
}

TEST(Vectors, NormalizedHasUnitLengthAndDirection) {
  expect_near(normalized(Vec3{3, 0, 4}), {0.6, 0.0, 0.8});
  const Vec3f unit = normalized(Vec3f{0, -5, 12});
  EXPECT_NEAR(unit.y, -5.0F / 13.0F, 2e-7F);  // three roundings of 2^-24
  EXPECT_NEAR(unit.z, 12.0F / 13.0F, 2e-7F);
  EXPECT_NEAR(norm(unit), 1.0F, 2e-7F);
}

TEST(Vectors, NormalizedZeroStaysZeroInSinglePrecision) {
  EXPECT_EQ(normalized(Vec3f{}), (Vec3f{}));
}

TEST(Pose, DefaultIsTheIdentity) {
  const Pose pose;
  const Vec3 point{1.5, -2.0, 3.0};
  EXPECT_EQ(pose.point(point), point);
  EXPECT_EQ(pose.from_world(point), point);
  EXPECT_EQ(pose.position(), (Vec3{}));
  EXPECT_EQ(pose.forward(), (Vec3{0, 0, 1}));
}

// From the origin along -z with +y up: the world's +x is on the right, +y is up in the image.
TEST(Pose, LookingAlongMinusZPutsXRightAndYUp) {
  const Pose pose = Pose::looking_at({0, 0, 0}, {0, 0, -1}, {0, 1, 0});
  expect_near(pose.from_world({1, 0, 0}), {1, 0, 0});
  expect_near(pose.from_world({0, 1, 0}), {0, -1, 0});
  expect_near(pose.from_world({0, 0, -1}), {0, 0, 1});
}

TEST(Pose, TargetLiesOnTheAxisAtItsDistance) {
  const Vec3 position{1, 2, 3};
  const Vec3 target{-3, 5, 3};  // five metres away
  const Pose pose = Pose::looking_at(position, target, {0, 0, 1});
  expect_near(pose.from_world(target), {0, 0, 5});
  expect_near(pose.from_world(position), {0, 0, 0});
  EXPECT_EQ(pose.position(), position);
}

TEST(Pose, IsARotationWithoutMirroring) {
  const Pose pose = Pose::looking_at({0.3, -1, 2}, {4, 1, -2}, {0.2, 1, 0.1});
  const Vec3 right = pose.vector({1, 0, 0});
  const Vec3 down = pose.vector({0, 1, 0});
  const Vec3 forward = pose.vector({0, 0, 1});
  EXPECT_NEAR(norm(right), 1.0, kTolerance);
  EXPECT_NEAR(norm(down), 1.0, kTolerance);
  EXPECT_NEAR(norm(forward), 1.0, kTolerance);
  expect_near(cross(right, down), forward);  // determinant +1
}

TEST(Pose, FromWorldUndoesPoint) {
  const Pose pose = Pose::looking_at({0.3, -1, 2}, {4, 1, -2}, {0.2, 1, 0.1});
  for (const Vec3 camera : {Vec3{0, 0, 0}, Vec3{1, -2, 0.5}, Vec3{-0.1, 0.2, 3}}) {
    expect_near(pose.from_world(pose.point(camera)), camera);
  }
}

TEST(Pose, TheLengthOfUpAndTheDistanceOfTheTargetDoNotMatter) {
  const Pose one = Pose::looking_at({0, 0, 0}, {1, 2, -3}, {0, 1, 0});
  const Pose other = Pose::looking_at({0, 0, 0}, {10, 20, -30}, {0, 1e-3, 0});
  for (const Vec3 axis : {Vec3{1, 0, 0}, Vec3{0, 1, 0}, Vec3{0, 0, 1}}) {
    expect_near(one.vector(axis), other.vector(axis));
  }
}

TEST(Pose, RefusesWhatHasNoImageUp) {
  const Vec3 here{1, 2, 3};
  EXPECT_EQ(refusal(here, here, {0, 1, 0}), ErrorCode::outside_domain);
  EXPECT_EQ(refusal(here, {1, 5, 3}, {0, 1, 0}), ErrorCode::outside_domain);
  EXPECT_EQ(refusal(here, {1, -5, 3}, {0, 1, 0}), ErrorCode::outside_domain);
  EXPECT_EQ(refusal(here, {0, 0, 0}, {0, 0, 0}), ErrorCode::outside_domain);
}

TEST(Pose, RefusesNotANumber) {
  EXPECT_EQ(refusal({kNan, 0, 0}, {0, 0, -1}, {0, 1, 0}), ErrorCode::outside_domain);
  EXPECT_EQ(refusal({0, 0, 0}, {0, kNan, -1}, {0, 1, 0}), ErrorCode::outside_domain);
  EXPECT_EQ(refusal({0, 0, 0}, {0, 0, -1}, {0, 1, kNan}), ErrorCode::outside_domain);
  const double infinite = std::numeric_limits<double>::infinity();
  EXPECT_EQ(refusal({0, 0, 0}, {0, 0, infinite}, {0, 1, 0}), ErrorCode::outside_domain);
}

}  // namespace
}  // namespace fstop
