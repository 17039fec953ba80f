#include "core/scene/scene_file.h"

#include <array>
#include <cerrno>
#include <cstdlib>
#include <fcntl.h>
#include <filesystem>
#include <fstream>
#include <map>
#include <optional>
#include <string>
#include <sys/prctl.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>
#include <vector>

#include <gtest/gtest.h>
#include <linux/filter.h>
#include <linux/seccomp.h>

#include "core/error.h"
#include "core/scene/handmade_files.h"

namespace fstop {
namespace {

namespace fs = std::filesystem;

constexpr AssetLimits kLimits{.max_file_bytes = 1000,
                              .max_triangles = 100,
                              .max_texture_pixels = 10'000,
                              .max_coordinate = 1e7};

// A folder with files, links and a pipe; its neighbour holds a file that must stay unread.
class FolderAssets : public testing::Test {
 protected:
  FolderAssets() {
    std::string pattern = (fs::temp_directory_path() / "fstop-assets-XXXXXX").string();
    base_ = mkdtemp(pattern.data());
    fs::create_directories(base_ / "scene/sub/deep");
    write("secret.txt", "secret");
    write("scene/a.txt", "alpha");
    write("scene/empty", "");
    write("scene/sub/deep/b-1.0_x.txt", "beta");
    write("scene/thousand", std::string(1000, 'x'));
    write("scene/more", std::string(1001, 'x'));
    fs::create_symlink("sub/deep/b-1.0_x.txt", base_ / "scene/inside");
    fs::create_symlink("../secret.txt", base_ / "scene/outside");
    fs::create_symlink((base_ / "secret.txt").string(), base_ / "scene/absolute");
    fs::create_symlink("..", base_ / "scene/up");
    fs::create_symlink("loop", base_ / "scene/loop");
    EXPECT_EQ(mkfifo((base_ / "scene/pipe").c_str(), 0600), 0);
  }
  ~FolderAssets() override { fs::remove_all(base_); }

  void write(const std::string& name, const std::string& text) const {
    std::ofstream(base_ / name, std::ios::binary) << text;
  }

  // What reading `name` throws; none if it does not.
  std::optional<ErrorCode> refusal(const std::string& name) const {
    try {
      folder_assets(base_ / "scene", kLimits)(name);
      return std::nullopt;
    } catch (const Error& error) {
      return error.code();
    }
  }
  std::string text(const std::string& name) const {
    const std::vector<std::byte> bytes = folder_assets(base_ / "scene", kLimits)(name);
    return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
  }

  fs::path base_;
};

TEST_F(FolderAssets, ReadsFilesBelowTheFolder) {
  EXPECT_EQ(text("a.txt"), "alpha");
  EXPECT_EQ(text("sub/deep/b-1.0_x.txt"), "beta");
  EXPECT_EQ(text("inside"), "beta");
  EXPECT_EQ(text("empty"), "");
  EXPECT_EQ(text("thousand").size(), 1000U);
}

TEST_F(FolderAssets, RefusesNamesThatAreNoPlainPaths) {
  const std::string absolute = (base_ / "scene/a.txt").string();
  for (const std::string& name :
       {std::string(), absolute, std::string("/etc/passwd"), std::string("../secret.txt"),
        std::string("sub/../a.txt"), std::string(".."), std::string("."), std::string("./a.txt"),
        std::string("sub//deep"), std::string("a.txt/"), std::string("sub\\deep"),
        std::string("a.txt\0.png", 10), std::string("a b"), std::string("\xc3\xa4"),
        std::string("a\n"), std::string("%2e%2e/secret.txt"), std::string(256, 'a')}) {
    EXPECT_EQ(refusal(name), ErrorCode::bad_path) << name;
  }
}

TEST_F(FolderAssets, NeverLeavesTheFolder) {
  for (const char* name : {"outside", "absolute", "up/secret.txt", "up/scene/a.txt", "loop"}) {
    EXPECT_EQ(refusal(name), ErrorCode::bad_path) << name;
  }
}

TEST_F(FolderAssets, RefusesWhatIsNoFile) {
  EXPECT_EQ(refusal("missing"), ErrorCode::not_found);
  EXPECT_EQ(refusal("missing/a.txt"), ErrorCode::not_found);
  EXPECT_EQ(refusal("a.txt/b"), ErrorCode::not_found);
  EXPECT_EQ(refusal("sub"), ErrorCode::bad_path);
  EXPECT_EQ(refusal("pipe"), ErrorCode::bad_path);  // and does not wait for a writer
  EXPECT_EQ(refusal("more"), ErrorCode::over_budget);
  fs::remove_all(base_ / "scene");
  EXPECT_EQ(refusal("a.txt"), ErrorCode::not_found);
}

TEST_F(FolderAssets, ShowsNamesWithoutControlCharacters) {
  try {
    folder_assets(base_ / "scene", kLimits)("evil\n\x1b[31m" + std::string(1000, 'a'));
    FAIL();
  } catch (const Error& error) {
    const std::string message = error.what();
    EXPECT_LT(message.size(), 256U);
    EXPECT_NE(message.find("evil???31maaaa"), std::string::npos) << message;
  }
}

// Makes the kernel answer openat2 as one that does not know it.
bool forget_openat2() {
  std::array<sock_filter, 4> filter = {{
      BPF_STMT(BPF_LD | BPF_W | BPF_ABS, 0),  // seccomp_data.nr
      BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, SYS_openat2, 0, 1),
      BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ERRNO | ENOSYS),
      BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ALLOW),
  }};
  const sock_fprog program = {.len = filter.size(), .filter = filter.data()};
  return prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) == 0 &&
         prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, &program) == 0;
}

// In a child process, since a filter cannot be taken off. Its exit code names the failed check.
TEST_F(FolderAssets, NeverLeavesTheFolderWithoutOpenat2) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  EXPECT_EXIT(
      {
        int code = 0;
        if (!forget_openat2()) code = 1;
        if (code == 0 && syscall(SYS_openat2, 0, nullptr, nullptr, 0) != -1) code = 2;
        if (code == 0 && errno != ENOSYS) code = 3;
        if (code == 0 && text("a.txt") != "alpha") code = 4;
        if (code == 0 && text("sub/deep/b-1.0_x.txt") != "beta") code = 5;
        for (const char* name : {"outside", "absolute", "inside", "loop", "pipe", "sub"}) {
          if (code == 0 && refusal(name) != ErrorCode::bad_path) code = 6;
        }
        if (code == 0 && !refusal("up/secret.txt")) code = 7;
        if (code == 0 && refusal("missing") != ErrorCode::not_found) code = 8;
        _exit(code);
      },
      testing::ExitedWithCode(0), "");
}

const char* const kTriangle = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";

// Assets in memory, which count how often they are read.
struct Memory {
  std::map<std::string, std::vector<std::byte>> files = {};
  std::map<std::string, int> reads = {};

  AssetReader reader() {
    return [this](const std::string& name) {
      ++reads[name];
      if (!files.contains(name)) throw Error(ErrorCode::not_found, name + ": none");
      return files.at(name);
    };
  }
};

Memory two_files() {
  Memory memory;
  memory.files["m.obj"] = handmade::bytes_of(kTriangle);
  memory.files["t.png"] =
      handmade::png(1, 8, handmade::PngColor::grey, {handmade::bytes_of("\xbc")});  // 188
  return memory;
}

Scene scene_using(const std::vector<std::string>& meshes,
                  const std::vector<std::pair<std::string, ColorSpace>>& textures) {
  Scene scene;
  for (const std::string& file : meshes)
    scene.objects.push_back({.shape = MeshObject{.file = file}});
  scene.objects.push_back({.shape = SphereObject{}});
  for (const auto& [file, space] : textures) {
    scene.textures.push_back({.name = file, .file = file, .color_space = space});
  }
  return scene;
}

TEST(LoadAssets, ReadsEachFileOnce) {
  Memory memory = two_files();
  Scene scene = scene_using(
      {"m.obj", "m.obj"},
      {{"t.png", ColorSpace::srgb}, {"t.png", ColorSpace::linear}, {"t.png", ColorSpace::srgb}});
  load_assets(scene, memory.reader(), kLimits);
  EXPECT_EQ(memory.reads, (std::map<std::string, int>{{"m.obj", 1}, {"t.png", 1}}));
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_EQ(std::get<MeshObject>(scene.objects[i].shape).mesh.triangles.size(), 1U);
  }
  EXPECT_NEAR(double{scene.textures[0].image.pixels()[0]}, 0.5028865, 1e-7);
  EXPECT_FLOAT_EQ(scene.textures[1].image.pixels()[0], 188.0F / 255.0F);
  EXPECT_EQ(scene.textures[2].image, scene.textures[0].image);
}

void expect_refused(Memory memory, Scene scene, const AssetLimits& limits, ErrorCode code,
                    const std::string& file) {
  try {
    load_assets(scene, memory.reader(), limits);
    ADD_FAILURE() << "no error for " << file;
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), code) << error.what();
    EXPECT_NE(std::string(error.what()).find(file), std::string::npos) << error.what();
  }
}

TEST(LoadAssets, NamesTheFileAtFault) {
  const Memory memory = two_files();
  const auto srgb = ColorSpace::srgb;
  expect_refused(memory, scene_using({"n.obj"}, {}), kLimits, ErrorCode::not_found, "n.obj");
  Memory broken = memory;
  broken.files["m.obj"].resize(20);
  expect_refused(broken, scene_using({"m.obj"}, {}), kLimits, ErrorCode::bad_geometry, "m.obj");
  broken.files["t.png"].resize(50);
  expect_refused(broken, scene_using({}, {{"t.png", srgb}}), kLimits, ErrorCode::bad_image,
                 "t.png");
}

TEST(LoadAssets, CountsEveryUseOfAFile) {
  const auto srgb = ColorSpace::srgb;
  AssetLimits limits = kLimits;
  limits.max_scene_triangles = 2;
  limits.max_scene_texture_pixels = 2;
  Memory memory = two_files();
  Scene scene = scene_using({"m.obj", "m.obj"}, {{"t.png", srgb}, {"t.png", srgb}});
  EXPECT_NO_THROW(load_assets(scene, memory.reader(), limits));
  expect_refused(two_files(), scene_using({"m.obj", "m.obj", "m.obj"}, {}), limits,
                 ErrorCode::over_budget, "m.obj");
  expect_refused(two_files(), scene_using({}, {{"t.png", srgb}, {"t.png", srgb}, {"t.png", srgb}}),
                 limits, ErrorCode::over_budget, "t.png");
}

}  // namespace
}  // namespace fstop
