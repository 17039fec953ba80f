#include "tests/references/openapi_agreement.h"

namespace fstop::api {
namespace {

TEST(OpenApi, AgreesWithTheParserOnComposites) {
  const json render = {{"scene", "charts"}, {"camera", {{"lens", json::object()}}}};
  const json original = {{"layers",
                          {{{"render", render}},
                           {{"render", std::string(64, 'a')}, {"operation", "overlay"}},
                           {{"image", {{"file", "charts/floor.png"}}},
                            {"operation", "key"},
                            {"key", {{"color", {0, 1, 0}}}}}}}};
  expect_agreement(original, Kind::composite,
                   {{"/layers", "[]", false},
                    {"/layers", "{}", false},
                    {"/layers", "[{}]", false},
                    {"/layers", "null", false},
                    {"/unknown", "1", false},
                    {"/outputs", R"(["alpha", "color"])", true},
                    {"/outputs", R"(["depth"])", false},
                    {"/outputs", "[]", false},
                    {"/image", R"({"format": "exr", "precision": "half"})", true},
                    {"/image", R"({"format": "gif"})", false},
                    {"/image", R"({"width": 3})", false},
                    {"/layers/0/image", R"({"file": "charts/floor.png"})", false},  // beside render
                    {"/layers/0/operation", "\"over\"", true},
                    {"/layers/0/operation", "\"under\"", false},
                    {"/layers/0/opacity", "0", true},
                    {"/layers/0/opacity", "1.01", false},
                    {"/layers/0/opacity", "\"1\"", false},
                    {"/layers/0/offset_px", "[-1000000, 1000000]", true},
                    {"/layers/0/offset_px", "[0]", false},
                    {"/layers/0/offset_px", "[0.5, 0]", false},
                    {"/layers/0/offset_px", "[0, 1000001]", false},
                    {"/layers/0/offset_px", "5", false},
                    {"/layers/0/z", "1", false},
                    {"/layers/0/render/camera/lens/f_number", "0.4", false},
                    {"/layers/0/render/camera/zoom", "1", false},
                    {"/layers/0/render/outputs", R"(["depth"])", true},
                    {"/layers/0/render", "5", false},
                    {"/layers/1/render", "\"abc\"", false},
                    {"/layers/1/render", "null", false},
                    {"/layers/2/key", "{}", false},
                    {"/layers/2/key/color", "[0, 1]", false},
                    {"/layers/2/key/color", "[0, -1, 0]", false},
                    {"/layers/2/key/softness", "0", true},
                    {"/layers/2/key/tolerance", "-0.1", false},
                    {"/layers/2/key/hue", "1", false},
                    {"/layers/2/image/file", "\"floor.png\"", false},
                    {"/layers/2/image/file", "\"\"", false},
                    {"/layers/2/image/base64", "\"AAAA\"", false},  // beside file
                    {"/layers/2/image/alpha", "\"premultiplied\"", true},
                    {"/layers/2/image/alpha", "\"none\"", false},
                    {"/layers/2/image/color_space", "\"linear\"", true},
                    {"/layers/2/image/color_space", "\"aces\"", false}});
}

TEST(OpenApi, AgreesWithTheParserOnMeasurements) {
  const std::string id(64, 'a');
  const json original = {{"render", id},
                         {"measurements",
                          {{{"kind", "spot"}},
                           {{"kind", "slanted-edge"}},
                           {{"kind", "star"},
                            {"center_px", {{"x", 9}, {"y", 9}}},
                            {"cycles", 12},
                            {"mean", 0.5},
                            {"amplitude", 0.5},
                            {"radii_px", {4}}},
                           {{"kind", "sharpness"}},
                           {{"kind", "disc-edge"}}}}};
  expect_agreement(
      original, Kind::measurement,
      {{"/render", "\"abc\"", false},
       {"/render", "1", false},
       {"/image", R"({"base64": "AAAA"})", false},  // beside render
       {"/unknown", "1", false},
       {"/measurements", "[]", false},
       {"/measurements", "{}", false},
       {"/measurements", R"([{"kind": "guess"}])", false},
       {"/measurements", R"([{}])", false},
       {"/measurements/0/channel", "\"red\"", true},
       {"/measurements/0/channel", "\"alpha\"", false},
       {"/measurements/0/region", R"({"x": 0, "y": 0, "width": 3, "height": 16384})", true},
       {"/measurements/0/region", R"({"x": 0, "y": 0, "width": 2, "height": 9})", false},
       {"/measurements/0/region", R"({"x": -1, "y": 0, "width": 9, "height": 9})", false},
       {"/measurements/0/region", R"({"x": 0, "y": 0, "width": 9})", false},
       {"/measurements/0/region", R"({"x": 0, "y": 0, "width": 9, "height": 9, "z": 1})", false},
       {"/measurements/0/background", "null", true},
       {"/measurements/0/background", "-0.5", true},
       {"/measurements/0/background", "\"border\"", false},
       {"/measurements/0/source_diameter_px", "0.5", true},
       {"/measurements/0/source_diameter_px", "-1", false},
       {"/measurements/0/blades", "7", true},
       {"/measurements/0/blades", "2", false},
       {"/measurements/0/fractions", "[0.838, 0.5]", true},
       {"/measurements/0/fractions", "[1]", false},
       {"/measurements/0/levels", R"({"dark": 0, "bright": 1})", false},
       {"/measurements/1/levels", R"({"dark": 0, "bright": 1})", true},
       {"/measurements/1/levels", R"({"dark": 0})", false},
       {"/measurements/2/radii_px", "[]", true},
       {"/measurements/2/radii_px", "[0]", false},
       {"/measurements/2/cycles", "1", false},
       {"/measurements/2/center_px", "[9, 9]", false},
       {"/measurements/2/phase_deg", "90", true},
       {"/measurements/2/amplitude", "0", false},
       {"/measurements/3/blades", "5", false},
       {"/measurements/4/levels", R"({"dark": 0, "bright": 1})", false}});
  const json sent = json::parse(file_text(FSTOP_SOURCE_DIR "/api/examples/measurements-spot.json"));
  expect_agreement(sent, Kind::measurement,
                   {{"/image/color_space", "\"srgb\"", true},
                    {"/image/color_space", "\"aces\"", false},
                    {"/image/pixel_um", "0", false},
                    {"/image/base64", "\"\"", false},
                    {"/image/base64", "5", false},
                    {"/image/file", "\"a.png\"", false},
                    {"/image", "{}", false}});
}

}  // namespace
}  // namespace fstop::api
