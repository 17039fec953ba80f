#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <set>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

#include <gtest/gtest.h>

namespace fs = std::filesystem;

namespace fstop {
namespace {

const fs::path kSource = FSTOP_SOURCE_DIR;

using Folders = std::set<std::string, std::less<>>;

// What each folder may include besides itself and core/*.h: light's way, one direction only.
const std::map<std::string, Folders, std::less<>>& layers() {
  static const std::map<std::string, Folders, std::less<>> table = [] {
    std::map<std::string, Folders, std::less<>> t = {
        {"core", {}},
        {"core/optics", {}},
        {"core/sampling", {}},
        {"core/film", {}},
        {"core/scene", {"core/sampling", "core/film", "core/optics"}},
        {"core/camera", {"core/optics"}},
        {"core/shading", {"core/scene", "core/sampling"}},
        {"core/post", {"core/optics", "core/film"}},
        {"core/measure", {"core/optics", "core/film"}},
        {"core/encode", {"core/film"}},
        {"core/render",
         {"core/optics", "core/sampling", "core/film", "core/scene", "core/camera", "core/shading",
          "core/post"}},
        {"server", {"api"}}};
    Folders all_of_core;
    for (const auto& [folder, targets] : t) {
      if (folder.starts_with("core")) all_of_core.insert(folder);
    }
    t["core/study"] = all_of_core;
    all_of_core.insert("core/study");
    t["api"] = all_of_core;
    return t;
  }();
  return table;
}

// A library's headers and where they may appear; the home is a folder, a file or a file's ending.
struct Home {
  std::string_view header = {};  // the beginning of the name in the angle brackets
  std::vector<std::string_view> places = {};
};

const std::vector<Home>& homes() {
  static const std::vector<Home> table = {
      {"embree3/", {"core/scene/"}},
      {"OpenImageIO/", {"core/encode/", "core/scene/*_file.cpp"}},
      {"opencv2/", {"core/measure/", "core/post/", "server/gaussian_process.cpp"}},
      {"tbb/", {"core/parallel.cpp"}},
      {"oneapi/", {"core/parallel.cpp"}},
      {"tiny_gltf.h", {"core/scene/"}},
      {"tiny_obj_loader.h", {"core/scene/"}},
      {"webp/", {"core/encode/"}},
      {"nlohmann/", {"api/"}},
      {"valijson/", {"api/"}},
      {"openssl/", {"api/"}},
      {"boost/", {"server/"}},
      {"spdlog/", {"server/"}},
      {"CLI/", {"server/"}},
      {"nats/", {"server/nats_*"}},
      {"sqlite3.h", {"server/sweep_state.cpp"}},
      {"gtest/", {}},  // tests alone
      {"benchmark/", {}}};
  return table;
}

// Folders of the C library, the kernel and the compiler.
const Folders kSystemFolders = {"sys", "net", "netinet", "arpa", "linux", "sanitizer"};

bool is_test(std::string_view file) { return file.ends_with("_test.cpp"); }

std::string_view folder_of(std::string_view file) {
  return file.substr(0, std::min(file.rfind('/'), file.size()));
}

bool lies_in(std::string_view file, std::string_view place) {
  if (const auto star = place.find('*'); star != std::string_view::npos) {
    return file.starts_with(place.substr(0, star)) && file.ends_with(place.substr(star + 1));
  }
  return place.ends_with('/') ? file.starts_with(place) : file == place;
}

std::string fault_of_own_header(std::string_view file, std::string_view target) {
  const std::string_view from = folder_of(file);
  const std::string_view to = folder_of(target);
  if (to == "core" && target.ends_with(".h")) return {};
  if (from == to && layers().contains(from)) return {};
  if (is_test(file) && to.starts_with("tests")) return {};
  const auto layer = layers().find(from);
  if (layer == layers().end()) return "a folder that the layers do not know";
  if (layer->second.contains(to)) return {};
  return std::string(from) + " must not know " + std::string(to);
}

std::string fault_of_library(std::string_view file, std::string_view header) {
  if (is_test(file)) return {};
  const auto home =
      std::ranges::find_if(homes(), [&](const Home& h) { return header.starts_with(h.header); });
  if (home != homes().end()) {
    const bool at_home = std::ranges::any_of(
        home->places, [&](std::string_view place) { return lies_in(file, place); });
    return at_home ? "" : "a library's header outside its home";
  }
  const auto slash = header.find('/');
  if (slash == std::string_view::npos || kSystemFolders.contains(header.substr(0, slash)))
    return {};
  return "a library without a home";
}

std::string_view without_leading_spaces(std::string_view text) {
  return text.substr(std::min(text.find_first_not_of(" \t"), text.size()));
}

// What a line includes, with its quotation marks or brackets; empty for any other line.
std::string_view included(std::string_view line) {
  constexpr std::string_view kInclude = "include";
  line = without_leading_spaces(line);
  if (!line.starts_with('#')) return {};
  line = without_leading_spaces(line.substr(1));
  if (!line.starts_with(kInclude)) return {};
  line = without_leading_spaces(line.substr(kInclude.size()));
  return line.substr(0, std::min(line.find_first_of("\">", 1), line.size() - 1) + 1);
}

/// What is wrong with the includes of a source: "file:line: name: why".
std::vector<std::string> include_faults(const std::string& file, const std::string& text) {
  std::vector<std::string> faults;
  std::istringstream lines(text);
  std::string line;
  for (int number = 1; std::getline(lines, line); ++number) {
    const std::string_view target = included(line);
    if (target.size() < 3) continue;
    const std::string_view name = target.substr(1, target.size() - 2);
    const std::string why =
        target[0] == '"' ? fault_of_own_header(file, name) : fault_of_library(file, name);
    if (why.empty()) continue;
    std::ostringstream fault;
    fault << file << ":" << number << ": " << name << ": " << why;
    faults.push_back(fault.str());
  }
  return faults;
}

std::string contents(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

// C++ sources below the folders, as paths from the root.
std::vector<std::string> sources_below(const std::vector<std::string>& folders) {
  std::vector<std::string> files;
  for (const std::string& folder : folders) {
    for (const auto& entry : fs::recursive_directory_iterator(kSource / folder)) {
      const fs::path extension = entry.path().extension();
      if (extension != ".h" && extension != ".cpp") continue;
      files.push_back(entry.path().lexically_relative(kSource).generic_string());
    }
  }
  std::ranges::sort(files);
  return files;
}

TEST(Architecture, EveryIncludeFollowsTheLayers) {
  const auto files = sources_below({"core", "api", "server"});
  ASSERT_GT(files.size(), 40U) << "too few sources below " << kSource;
  for (const std::string& file : files) {
    for (const std::string& fault : include_faults(file, contents(kSource / file))) {
      ADD_FAILURE() << fault;
    }
  }
}

TEST(Architecture, EveryOwnHeaderIsNamedFromTheRoot) {
  for (const std::string& file : sources_below({"core", "api", "server", "tests"})) {
    std::istringstream lines(contents(kSource / file));
    for (std::string line; std::getline(lines, line);) {
      if (!line.starts_with("#include \"")) continue;
      const std::string name = line.substr(10, line.find('"', 10) - 10);
      EXPECT_TRUE(fs::exists(kSource / name)) << file << " includes " << name;
    }
  }
}

// Edges that must be found, and ones that must not: the test above sees what it says it sees.
TEST(Architecture, ForbiddenIncludesAreFound) {
  const auto faults = [](const std::string& file, const std::string& include) {
    return include_faults(file, "#pragma once\n\n" + include + "\n").size();
  };
  for (const auto& [file, include] : std::vector<std::pair<std::string, std::string>>{
           {"core/optics/lens.cpp", "#include \"core/film/film.h\""},
           {"core/optics/lens_test.cpp", "#include \"core/film/film.h\""},
           {"core/film/film.h", "#include \"core/optics/thin_lens.h\""},
           {"core/sampling/warp.h", "#include \"core/scene/scene.h\""},
           {"core/camera/camera.h", "#include \"core/scene/scene.h\""},
           {"core/shading/light.h", "#include \"core/camera/camera.h\""},
           {"core/render/planner.cpp", "#include \"core/encode/image_codec.h\""},
           {"core/render/planner.cpp", "#include \"core/measure/sharpness.h\""},
           {"core/encode/image_codec.cpp", "#include \"core/render/method.h\""},
           {"core/units.h", "#include \"core/optics/thin_lens.h\""},
           {"core/units.h", "#include \"api/problem.h\""},
           {"core/units.h", "#include \"tests/references/oracle.h\""},
           {"api/problem.cpp", "#include \"server/session.h\""},
           {"server/main.cpp", "#include \"core/render/simulation.h\""},
           {"core/newcomer/file.cpp", "#include \"core/film/film.h\""},
           {"core/render/planner.cpp", "#include <embree3/rtcore.h>"},
           {"core/render/planner.cpp", "  #  include  <tbb/parallel_for.h>"},
           {"core/scene/texture.cpp", "#include<OpenImageIO/imageio.h>"},
           {"core/film/film.cpp", "#include <nlohmann/json.hpp>"},
           {"api/problem.cpp", "#include <boost/asio/post.hpp>"},
           {"server/queue_worker.cpp", "#include <nats/nats.h>"},
           {"core/scene/scene.h", "#include <gtest/gtest.h>"},
           {"core/scene/scene.h", "#include <eigen3/Eigen/Core>"}}) {
    EXPECT_EQ(faults(file, include), 1U) << file << " " << include;
  }
  for (const auto& [file, include] : std::vector<std::pair<std::string, std::string>>{
           {"core/optics/lens.cpp", "#include \"core/units.h\""},
           {"core/optics/lens.cpp", "#include \"core/optics/thin_lens.h\""},
           {"core/optics/lens.cpp", "#include <cmath>"},
           {"core/optics/lens_test.cpp", "#include \"tests/references/oracle.h\""},
           {"core/film/film_test.cpp", "#include <nlohmann/json.hpp>"},
           {"core/render/planner.cpp", "#include \"core/camera/camera.h\""},
           {"core/scene/ray_scene.cpp", "#include <embree3/rtcore.h>"},
           {"core/scene/texture_file.cpp", "#include <OpenImageIO/imageio.h>"},
           {"core/parallel.cpp", "#include <sys/resource.h>"},
           {"core/study/sweep.cpp", "#include \"core/measure/sharpness.h\""},
           {"api/picture.cpp", "#include \"core/encode/image_codec.h\""},
           {"server/nats_broker.h", "#include <nats/nats.h>"},
           {"server/main.cpp", "#include \"core/error.h\""},
           {"server/main.cpp", "#include \"api/problem.h\""},
           {"server/main.cpp", "// #include \"core/film/film.h\""}}) {
    EXPECT_EQ(faults(file, include), 0U) << file << " " << include;
  }
}

TEST(Architecture, EveryFolderOfCoreHasItsLayer) {
  for (const auto& entry : fs::directory_iterator(kSource / "core")) {
    if (!entry.is_directory() || entry.path().filename() == "scenes") continue;  // data
    EXPECT_TRUE(layers().contains("core/" + entry.path().filename().string())) << entry.path();
  }
}

TEST(Architecture, FilesStayShort) {
  for (const std::string& file : sources_below({"core", "api", "server", "tests"})) {
    const std::string text = contents(kSource / file);
    EXPECT_LE(std::ranges::count(text, '\n'), 500) << file;
  }
}

TEST(Architecture, TopLevelIsFixed) {
  const Folders fixed = {"CMakeLists.txt", "core",       "api",      "server", "web",
                         "tests",          "Dockerfile", "README.md"};
  Folders allowed = fixed;
  allowed.insert({"CMakePresets.json", "LICENSE", "dev"});
  std::istringstream ignored(contents(kSource / ".gitignore"));
  for (std::string line; std::getline(ignored, line);) {
    std::erase(line, '/');
    allowed.insert(line);
  }
  for (const auto& entry : fs::directory_iterator(kSource)) {
    const std::string name = entry.path().filename().string();
    if (name.ends_with(".png") || name.ends_with(".exr")) continue;  // rendered here by a reader
    EXPECT_TRUE(name.starts_with('.') || allowed.contains(name)) << name;
  }
  for (const std::string& name : fixed) EXPECT_TRUE(fs::exists(kSource / name)) << name;
}

}  // namespace
}  // namespace fstop
