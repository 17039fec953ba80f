#include "api/psf_request.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "api/contract_schema.h"
#include "api/json_text.h"
#include "api/problem.h"
#include "core/encode/image_codec.h"
#include "core/optics/diffraction.h"
#include "tests/references/oracle.h"

namespace fstop::api {
namespace {

using nlohmann::json;

json answer(const json& request) {
  const json value =
      json::parse(psf_json(parse_psf_request(request.dump(), Limits{}), Limits{}, {}));
  EXPECT_EQ(ContractSchema("PsfReport").objection(value), "") << request;
  return value;
}

std::vector<std::string> pointers(const std::string& body, const Limits& limits = {}) {
  std::vector<std::string> result;
  try {
    psf_json(parse_psf_request(body, limits), limits, {});
  } catch (const InvalidRequest& invalid) {
    for (const FieldFault& fault : invalid.faults()) result.push_back(fault.pointer);
  }
  return result;
}

std::string refusal(const std::string& body) {
  try {
    psf_json(parse_psf_request(body, Limits{}), Limits{}, {});
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::outside_domain);
    return error.what();
  }
  return "accepted";
}

// The fixture's tolerances: 1e-11 of the profile's peak, 1e-12 of the OTF, 1e-9 of radii. Lengths
// pass through decimal numbers: 1e-15 of v times the profile's slope is far below.
TEST(PsfRequest, AnswersEveryPinholeOfTheFixture) {
  const nlohmann::json table = oracle::fixture("pinhole_psf");
  ASSERT_GE(table.at("rows").size(), 5U);
  for (const json& row : table.at("rows")) {
    const json& distance = row.at("object_distance_mm");
    json request = {
        {"camera",
         {{"pinhole",
           {{"image_distance_mm", row.at("f_prime_mm")}, {"diameter_mm", row.at("d_mm")}}}}},
        {"object_distance_m", "infinity"},
        {"wavelength_nm", row.at("lambda_mm").get<double>() * 1e6},
        {"fractions", {0.5, 0.8}}};
    if (distance.is_number()) request["object_distance_m"] = distance.get<double>() / 1e3;
    double peak = 0.0;
    for (const json& at : row.at("profile")) {
      request["radii_um"].push_back(at.at("rho_mm").get<double>() * 1e3);
      peak = std::max(peak, at.at("psf_per_mm2").get<double>());
    }
    for (const json& at : row.at("mtf")) {
      request["frequencies_per_mm"].push_back(at.at("nu_cyc_per_mm"));
    }
    const json value = answer(request);
    ASSERT_EQ(value["profile"].size(), row.at("profile").size());
    for (std::size_t i = 0; i < row.at("profile").size(); ++i) {
      EXPECT_DOUBLE_EQ(value["profile"][i]["radius_um"].get<double>(),
                       request["radii_um"][i].get<double>());
      EXPECT_NEAR(value["profile"][i]["psf_per_mm2"].get<double>(),
                  row.at("profile")[i].at("psf_per_mm2").get<double>(), 1e-11 * peak);
    }
    ASSERT_EQ(value["otf"].size(), row.at("mtf").size());
    for (std::size_t i = 0; i < row.at("mtf").size(); ++i) {
      EXPECT_NEAR(value["otf"][i]["otf"].get<double>(), row.at("mtf")[i].at("otf").get<double>(),
                  1e-12);
    }
    for (const auto& [i, name] : {std::pair{0, "ee50_radius_mm"}, {1, "ee80_radius_mm"}}) {
      const double expected = row.at(name).get<double>() * 1e3;
      EXPECT_NEAR(value["encircled_energy"][i]["radius_um"].get<double>(), expected,
                  1e-9 * expected);
    }
    EXPECT_NEAR(value["fresnel_number"].get<double>(), row.at("N_F").get<double>(),
                1e-12 * row.at("N_F").get<double>());
  }
}

// By hand, in focus at infinity: peak pi/(4 lambda^2 N^2) = 40568.09 per mm^2 at f/8 and 550 nm;
// cut-off 1/(lambda N); T(1) = 2/pi (pi/3 - sqrt(3)/4); Rayleigh's 1 - J0^2 - J1^2 inside v.
TEST(PsfRequest, FillsDefaultsForALensInFocus) {
  const json value = answer(
      json::parse(R"({"camera": {"lens": {"f_number": 8, "focus_distance_m": "infinity"}}})"));
  EXPECT_EQ(value["object_distance_m"], "infinity");
  EXPECT_EQ(value["wavelength_nm"], 550.0);
  EXPECT_EQ(value["spectrum"], "monochromatic");
  EXPECT_EQ(value["regime"], "fraunhofer");
  EXPECT_EQ(value["fresnel_number"], 0.0);
  const double pi = std::numbers::pi;
  ASSERT_EQ(value["profile"].size(), 65U);
  EXPECT_NEAR(value["profile"][0]["psf_per_mm2"].get<double>(),
              pi / (4.0 * 0.00055 * 0.00055 * 64.0), 1e-7);
  const double airy = 1.2196698912665045 * 0.55 * 8.0;
  EXPECT_NEAR(value["airy_diameter_um"].get<double>(), 2.0 * airy, 1e-9);
  EXPECT_NEAR(value["profile"][64]["radius_um"].get<double>(), 4.0 * airy, 1e-9);
  EXPECT_NEAR(value["profile"][16]["psf_per_mm2"].get<double>(), 0.0, 1e-9);
  ASSERT_EQ(value["otf"].size(), 65U);
  EXPECT_NEAR(value["cut_off_per_mm"].get<double>(), 1.0 / (0.00055 * 8.0), 1e-9);
  EXPECT_NEAR(value["otf"][64]["frequency_per_mm"].get<double>(), 1.0 / (0.00055 * 8.0), 1e-9);
  EXPECT_NEAR(value["otf"][32]["otf"].get<double>(), 2.0 / pi * (pi / 3.0 - std::sqrt(3.0) / 4.0),
              1e-12);
  ASSERT_EQ(value["encircled_energy"].size(), 3U);
  for (const json& at : value["encircled_energy"]) {
    const double v = pi * at["radius_um"].get<double>() / (0.55 * 8.0);
    EXPECT_NEAR(airy_encircled_energy(v), at["fraction"].get<double>(), 1e-9);
  }
  EXPECT_FALSE(value.contains("image"));
  EXPECT_TRUE(value["warnings"].empty());
}

// A sensor that stays at f has the blur scaled by f/v: frequencies by v/f.
TEST(PsfRequest, LensesThatDoNotBreatheScaleTheImage) {
  json request = {{"camera", {{"lens", {{"f_number", 8}, {"focus_distance_m", 0.5}}}}},
                  {"object_distance_m", 0.52}};
  const json breathing = answer(request);
  request["camera"]["breathing"] = false;
  const json still = answer(request);
  const double ratio = 0.5 / 0.45;  // v/f = s/(s - f)
  EXPECT_NEAR(breathing["geometric_diameter_um"].get<double>() /
                  still["geometric_diameter_um"].get<double>(),
              ratio, 1e-12);
  EXPECT_NEAR(still["cut_off_per_mm"].get<double>() / breathing["cut_off_per_mm"].get<double>(),
              ratio, 1e-12);
  EXPECT_EQ(breathing["fresnel_number"], still["fresnel_number"]);
}

TEST(PsfRequest, RgbHasThreeOfEach) {
  const json value = answer(json::parse(R"({"camera": {"pinhole": {"diameter_mm": 0.3}},
      "spectrum": "rgb", "field_angle_deg": 25, "radii_um": [0, 100], "fractions": [0.5],
      "frequencies_per_mm": [0, 3], "image": {"width": 32, "height": 20, "pixel_um": 20}})"));
  EXPECT_GE(value["wavelengths"].get<int>(), 17);
  for (const char* member : {"psf_per_mm2", "psf_y_per_mm2"}) {
    EXPECT_EQ(value["profile"][1][member].size(), 3U) << member;
  }
  for (const char* member : {"otf", "otf_y"}) {
    EXPECT_EQ(value["otf"][1][member].size(), 3U) << member;
    EXPECT_NEAR(value["otf"][0][member][1].get<double>(), 1.0, 1e-12);
  }
  EXPECT_FALSE(value["otf"][1].contains("otf_imaginary"));
  EXPECT_EQ(value["encircled_energy"][0]["radius_um"].size(), 3U);
  // Blue is bent least.
  EXPECT_GT(value["otf"][1]["otf_y"][2], value["otf"][1]["otf_y"][0]);
  EXPECT_EQ(value["image"]["width"], 32);
  EXPECT_EQ(value["image"]["energy"].size(), 3U);
  EXPECT_GT(value["error"]["spectral"], 0.0);
  EXPECT_EQ(value["error_bound"].get<double>(),
            value["error"]["model"].get<double>() + value["error"]["spectral"].get<double>());
}

TEST(PsfRequest, OddBladesOutOfFocusHaveAPhase) {
  json request = {{"camera", {{"lens", {{"f_number", 8}, {"blades", 3}}}}},
                  {"object_distance_m", 3},
                  {"frequencies_per_mm", {10}},
                  {"field_angle_deg", 10}};
  const json value = answer(request);
  EXPECT_GT(std::abs(value["otf"][0]["otf_imaginary"].get<double>()), 0.01);
  EXPECT_NEAR(value["otf"][0]["otf_y_imaginary"].get<double>(), 0.0, 1e-12);  // its axis is x
  ASSERT_EQ(value["warnings"].size(), 1U);
  EXPECT_NE(value["warnings"][0].get<std::string>().find("field_angle_deg"), std::string::npos);
  request["camera"]["lens"]["blades"] = 4;
  EXPECT_FALSE(answer(request)["otf"][0].contains("otf_imaginary"));
}

// EXR keeps the density; PNG shows asinh(1000 p)/asinh(1000), whose brightest pixel is white.
TEST(PsfRequest, PicturesAreDensityOrStretched) {
  const PsfRequest request = parse_psf_request(
      R"({"camera": {"lens": {"f_number": 16}}, "image": {"width": 33, "height": 21,
          "pixel_um": 1}})",
      Limits{});
  const PsfPicture exr = psf_picture(request, ImageFormat::exr, Limits{}, {});
  const Picture file = decode(encode(exr.picture, ImageFormat::exr));
  ASSERT_EQ(file.layers.size(), 1U);
  EXPECT_EQ(file.layers[0].channel_names, std::vector<std::string>{"Y"});
  const Image& density = file.layers[0].image;
  ASSERT_EQ(density.width(), 33);
  ASSERT_EQ(density.height(), 21);
  // Brightest in the middle pixel, below the peak of the density, pi/(4 lambda^2 N_w^2).
  const double working = 16.0 * (1.0 + 50.0 / 1950.0);
  const double peak = std::numbers::pi / (4.0 * std::pow(0.00055 * working, 2));
  EXPECT_GT(density.at(16, 10)[0], 0.97 * peak);
  EXPECT_LT(density.at(16, 10)[0], peak);
  EXPECT_EQ(density.at(15, 10)[0], density.at(17, 10)[0]);
  EXPECT_EQ(density.at(3, 2)[0], density.at(29, 18)[0]);
  const auto has = [&](const char* name) {
    return std::ranges::find(file.attributes, name, &ImageAttribute::name) != file.attributes.end();
  };
  for (const char* name : {"fstop:quantity", "fstop:pixelUm", "fstop:energyR", "fstop:errorBound"})
    EXPECT_TRUE(has(name)) << name;

  const PsfPicture png = psf_picture(request, ImageFormat::png, Limits{}, {});
  const Image shown = decode(encode(png.picture, ImageFormat::png)).layers[0].image;
  EXPECT_EQ(shown.at(16, 10)[0], 1.0F);
  const double p = density.at(12, 8)[0] / density.at(16, 10)[0];
  const double linear = std::asinh(1000.0 * p) / std::asinh(1000.0);
  const double encoded = 1.055 * std::pow(linear, 1.0 / 2.4) - 0.055;  // IEC 61966-2-1
  EXPECT_NEAR(shown.at(12, 8)[0], encoded, 0.51 / 255.0);
  EXPECT_NE(png.stretch.find("asinh(1000 p)"), std::string::npos);
  EXPECT_NE(exr.stretch.find("1/mm^2"), std::string::npos);
}

TEST(PsfRequest, RefusesWithPointers) {
  using Pointers = std::vector<std::string>;
  EXPECT_EQ(pointers("{}"), Pointers{"#/camera"});
  EXPECT_EQ(pointers(R"({"camera": {"pinhole": {}}, "radii_um": [1, -1], "frequencies_per_mm":
                        [1, "2"], "fractions": [0.5, 1], "spectrum": "white",
                        "field_angle_deg": 91, "image": {"pixel_um": 0, "stretch": "gamma",
                        "depth": 1}, "colour": 1})"),
            (Pointers{"#/spectrum", "#/field_angle_deg", "#/radii_um/1", "#/frequencies_per_mm/1",
                      "#/fractions/1", "#/image/pixel_um", "#/image/stretch", "#/image/depth",
                      "#/colour"}));
  EXPECT_EQ(pointers(R"({"camera": {"pinhole": {}}, "frequencies_per_mm": 3})"),
            Pointers{"#/frequencies_per_mm"});
  EXPECT_EQ(pointers(R"({"camera": {"pinhole": {}}, "image": {"width": 1025}})"),
            Pointers{"#/image/width"});
}

TEST(PsfRequest, RefusesTooMuchWorkWithThePointer) {
  using Pointers = std::vector<std::string>;
  EXPECT_EQ(pointers(R"({"camera": {"lens": {}}, "object_distance_m": "infinity",
                        "spectrum": "rgb"})"),
            Pointers{"#/spectrum"});
  EXPECT_EQ(pointers(R"({"camera": {"lens": {"blades": 6}}, "object_distance_m": 3,
                        "image": {"width": 1000, "height": 1000, "pixel_um": 20}})"),
            Pointers{"#/image"});
  Limits tight;
  tight.psf_operations = 500.0;
  const std::string lens = R"({"camera": {"lens": {"f_number": 8}}, )";
  EXPECT_EQ(pointers(lens + R"("frequencies_per_mm": []})", tight), Pointers{"#/fractions"});
  EXPECT_EQ(pointers(lens + R"("radii_um": [], "fractions": []})", tight),
            Pointers{"#/frequencies_per_mm"});
  tight.psf_operations = 100.0;
  EXPECT_EQ(pointers(lens + R"("fractions": []})", tight), Pointers{"#/radii_um"});
}

TEST(PsfRequest, PassesTheModelsReasonOn) {
  EXPECT_NE(refusal(R"({"camera": {"pinhole": {"diameter_mm": 0.0055}, "wavelength_nm": 550},
                        "wavelength_nm": 600})")
                .find("5 wavelengths"),
            std::string::npos);
  EXPECT_NE(refusal(R"({"camera": {"pinhole": {}}, "field_angle_deg": 80})").find("75 degrees"),
            std::string::npos);
  EXPECT_NE(refusal(R"({"camera": {"lens": {"f_number": 0.9}}})").find("f-number"),
            std::string::npos);
}

}  // namespace
}  // namespace fstop::api
