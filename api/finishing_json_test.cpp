// Halftones, sampling patterns and texture widths in requests.
#include <numbers>
#include <string>

#include <gtest/gtest.h>

#include "api/json_text.h"
#include "api/picture.h"
#include "api/render_request.h"

namespace fstop::api {
namespace {

using nlohmann::json;

std::string with(const std::string& image, const std::string& quality = "{}") {
  return R"({"scene": "still-life", "camera": {"lens": {}}, "image": )" + image +
         R"(, "quality": )" + quality + "}";
}

RenderRequest parsed(const std::string& body) {
  return parse_render_request(body, Limits{}, SceneNames::stored_only);
}

// The only fault of `body`: its pointer and text; empty where there is none.
FieldFault fault_of(const std::string& body) {
  try {
    parsed(body);
  } catch (const InvalidRequest& invalid) {
    EXPECT_EQ(invalid.faults().size(), 1U) << body;
    return invalid.faults().front();
  }
  return {};
}

TEST(Finishing, HalftonesAreRead) {
  const RenderRequest plain = parsed(with("{}"));
  EXPECT_FALSE(plain.spec.halftone);
  const RenderRequest asked = parsed(with(R"({"halftone": {}})"));
  ASSERT_TRUE(asked.spec.halftone);
  EXPECT_EQ(asked.spec.halftone->method, HalftoneMethod::clustered_dot);
  EXPECT_EQ(asked.spec.halftone->cell, 4.0);
  EXPECT_EQ(asked.spec.halftone->levels, 2);
  EXPECT_FALSE(asked.spec.halftone->symmetric);
  EXPECT_NE(plain.canonical, asked.canonical) << "another picture, another id";
  EXPECT_EQ(parsed(with(R"({"halftone": null})")).canonical, plain.canonical);

  const HalftoneSpec dots =
      *parsed(with(R"({"halftone": {"method": "varying-dot", "cell_px": 5.5, "angle_deg": 30,
                                    "levels": 4, "gray": true}})"))
           .spec.halftone;
  EXPECT_EQ(dots.cell, 5.5);
  EXPECT_NEAR(dots.angle, std::numbers::pi / 6.0, 1e-15);
  EXPECT_EQ(dots.levels, 4);
  EXPECT_TRUE(dots.gray);
}

TEST(Finishing, WhatIsReadMeansTheSameWhenItIsReadAgain) {
  for (const char* halftone : {R"({"method": "clustered-dot", "symmetric": true})",
                               R"({"method": "dispersed-dot", "cell_px": 8,
          "cells": "per-pixel"})",
                               R"({"method": "varying-dot", "cell_px": 6.5})",
                               R"({"method": "error-diffusion", "levels": 3})"}) {
    const RenderRequest first = parsed(with(std::string(R"({"halftone": )") + halftone + "}"));
    EXPECT_EQ(parsed(first.normalised).normalised, first.normalised);
  }
  const RenderRequest first = parsed(
      with("{}", R"({"samples": 16, "sampling": {"lens": "poisson-disc"}, "texture_width_px": 1,
                "texture_disc_share": 0.25})"));
  EXPECT_EQ(parsed(first.normalised).normalised, first.normalised);
  EXPECT_EQ(first.spec.quality.sampling.lens, SamplePattern::poisson_disc);
  EXPECT_EQ(first.spec.quality.sampling.pixel, SamplePattern::low_discrepancy);
  EXPECT_EQ(first.spec.quality.texture_width_px, 1.0);
  EXPECT_EQ(first.spec.quality.texture_disc_share, 0.25);
}

TEST(Finishing, EachFaultIsToldAtItsMember) {
  struct Case {
    const char* image;
    const char* quality;
    const char* pointer;
    const char* part;  // of the text
  };
  const Case cases[] = {
      {R"({"halftone": 3})", "{}", "#/image/halftone", "object"},
      {R"({"halftone": {"method": "dots"}})", "{}", "#/image/halftone/method", "clustered-dot"},
      {R"({"halftone": {"cell_px": 1}})", "{}", "#/image/halftone/cell_px", "2 px to 16 px"},
      {R"({"halftone": {"cell_px": 4.5}})", "{}", "#/image/halftone/cell_px", "whole"},
      {R"({"halftone": {"method": "dispersed-dot", "cell_px": 5}})", "{}",
       "#/image/halftone/cell_px", "2, 3, 4"},
      {R"({"halftone": {"levels": 1}})", "{}", "#/image/halftone/levels", "2 to 256"},
      {R"({"halftone": {"angle_deg": 30}})", "{}", "#/image/halftone/angle_deg", "varying-dot"},
      {R"({"halftone": {"method": "varying-dot", "symmetric": true}})", "{}",
       "#/image/halftone/symmetric", "clustered-dot"},
      {R"({"halftone": {"method": "error-diffusion", "cell_px": 4}})", "{}",
       "#/image/halftone/cell_px", "needs method"},
      {R"({"halftone": {"method": "error-diffusion", "cells": "per-pixel"}})", "{}",
       "#/image/halftone/cells", "dispersed-dot"},
      {R"({"width": 9600, "height": 6400, "halftone": {"cells": "per-pixel"}})", "{}",
       "#/image/halftone/cells", "16384"},
      {R"({"halftone": {"size": 3}})", "{}", "#/image/halftone/size", "unknown"},
      {"{}", R"({"samples": 16, "sampling": {"lens": "hexagonal"}})", "#/quality/sampling/lens",
       "poisson-disc"},
      {"{}", R"({"sampling": {"lens": "jittered"}})", "#/quality/sampling", "samples"},
      {"{}", R"({"samples": 2048, "sampling": {"lens": "jittered"}})", "#/quality/sampling",
       "1024"},
      {"{}", R"({"samples": 16, "sampling": {"light": "jittered"}})", "#/quality/sampling/light",
       "unknown"},
      {"{}", R"({"texture_width_px": -1})", "#/quality/texture_width_px", "0 px to 64 px"},
      {"{}", R"({"texture_disc_share": 0.6})", "#/quality/texture_disc_share", "0 to 0.5"},
      {"{}", R"({"texture_disc_share": null})", "#/quality/texture_disc_share", "number"},
  };
  for (const Case& c : cases) {
    const FieldFault fault = fault_of(with(c.image, c.quality));
    EXPECT_EQ(fault.pointer, c.pointer) << c.image << c.quality;
    EXPECT_NE(fault.detail.find(c.part), std::string::npos) << fault.detail;
  }
}

TEST(Finishing, FilesOfEightBitsAreHalftonedAndDataAreNot) {
  Photograph photograph;
  photograph.color = Image(8, 8, 3);
  for (float& value : photograph.color.pixels()) value = 0.3F;
  SimulationSpec spec = parsed(with(R"({"width": 9, "height": 6})")).spec;
  spec.width = spec.height = 8;
  spec.halftone = HalftoneSpec{};
  for (const ImageFormat format : {ImageFormat::png, ImageFormat::jpeg, ImageFormat::webp}) {
    const Picture picture = picture_of(photograph, spec, "id", format);
    for (const float value : picture.layers[0].image.pixels()) {
      EXPECT_TRUE(value == 0.0F || value == 1.0F);
    }
  }
  for (const ImageFormat format : {ImageFormat::exr, ImageFormat::tiff}) {
    EXPECT_EQ(picture_of(photograph, spec, "id", format).layers[0].image, photograph.color);
  }
}

}  // namespace
}  // namespace fstop::api
