#include "core/scene/scene_file.h"

#include <algorithm>
#include <cerrno>
#include <fcntl.h>
#include <map>
#include <string_view>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <system_error>
#include <unistd.h>
#include <utility>
#include <variant>

#include <linux/openat2.h>

#include "core/error.h"
#include "core/scene/vertex_normals.h"

namespace fstop {
namespace {

class FileDescriptor {
 public:
  explicit FileDescriptor(int value) : value_(value) {}
  ~FileDescriptor() {
    if (value_ >= 0) ::close(value_);
  }
  FileDescriptor(FileDescriptor&& other) noexcept : value_(std::exchange(other.value_, -1)) {}
  FileDescriptor& operator=(FileDescriptor&& other) noexcept {
    std::swap(value_, other.value_);
    return *this;
  }
  FileDescriptor(const FileDescriptor&) = delete;
  FileDescriptor& operator=(const FileDescriptor&) = delete;
  int get() const { return value_; }

 private:
  int value_;
};

constexpr std::size_t kMaxNameLength = 255;

bool is_plain(char c) {
  return (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '.' ||
         c == '_' || c == '-';
}

// A name from a request, fit for a message: shortened, without control characters.
std::string shown(std::string_view name) {
  std::string text;
  for (const char c : name.substr(0, 64)) text += is_plain(c) || c == '/' ? c : '?';
  return text + (name.size() > 64 ? "..." : "");
}

// Parts of plain characters, none of them empty, "." or "..", joined by single slashes.
bool is_plain_path(std::string_view name) {
  if (name.empty() || name.size() > kMaxNameLength) return false;
  while (true) {
    const std::size_t end = std::min(name.find('/'), name.size());
    const std::string_view part = name.substr(0, end);
    if (part.empty() || part == "." || part == ".." ||
        !std::all_of(part.begin(), part.end(), is_plain)) {
      return false;
    }
    if (end == name.size()) return true;
    name.remove_prefix(end + 1);
  }
}

// O_NONBLOCK: opening a pipe must not wait for its other end.
constexpr int kReadFlags = O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY;

// For kernels and sandboxes without openat2: one part after another, through no link at all.
FileDescriptor open_by_parts(int folder, std::string_view name) {
  FileDescriptor at(-1);
  while (true) {
    const std::size_t end = std::min(name.find('/'), name.size());
    const bool last = end == name.size();
    const std::string part(name.substr(0, end));
    const int flags =
        last ? kReadFlags | O_NOFOLLOW : O_PATH | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC;
    at = FileDescriptor(::openat(at.get() < 0 ? folder : at.get(), part.c_str(), flags));
    if (at.get() < 0 || last) return at;
    name.remove_prefix(end + 1);
  }
}

// Links may lead anywhere inside `folder`, none out of it; errno where there is no file.
FileDescriptor open_beneath(int folder, const std::string& name) {
  open_how how = {};
  how.flags = kReadFlags;
  how.resolve = RESOLVE_BENEATH | RESOLVE_NO_MAGICLINKS;
  const long file = ::syscall(SYS_openat2, folder, name.c_str(), &how, sizeof how);
  if (file < 0 && (errno == ENOSYS || errno == EPERM)) return open_by_parts(folder, name);
  return FileDescriptor(static_cast<int>(file));
}

[[noreturn]] void refuse_file(const std::string& name, int error) {
  switch (error) {
    case ENOENT:
    case ENOTDIR:
      throw Error(ErrorCode::not_found, name + ": there is no such file");
    case EXDEV:  // openat2: the way leads out of the folder
    case ELOOP:
      throw Error(ErrorCode::bad_path, name + ": a link leads out of the scene's folder");
    default:
      throw Error(ErrorCode::io_failure,
                  name + ": cannot be read: " + std::generic_category().message(error));
  }
}

std::vector<std::byte> contents(const std::string& name, const FileDescriptor& file,
                                std::size_t size) {
  std::vector<std::byte> bytes(size);
  std::size_t done = 0;
  while (done < size) {
    const ssize_t count = ::read(file.get(), bytes.data() + done, size - done);
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) refuse_file(name, errno);
    if (count == 0) break;  // shorter than it was a moment ago
    done += static_cast<std::size_t>(count);
  }
  bytes.resize(done);
  return bytes;
}

std::vector<std::byte> read_beneath(const std::filesystem::path& folder, const std::string& name,
                                    std::size_t max_bytes) {
  if (!is_plain_path(name)) {
    throw Error(ErrorCode::bad_path,
                "'" + shown(name) +
                    "' is not a file of the scene: names are relative, of at most " +
                    std::to_string(kMaxNameLength) +
                    " letters, digits, '.', '_', '-' and '/', without '..'");
  }
  const FileDescriptor root(::open(folder.c_str(), O_PATH | O_DIRECTORY | O_CLOEXEC));
  if (root.get() < 0) refuse_file(name, errno);
  const FileDescriptor file = open_beneath(root.get(), name);
  if (file.get() < 0) refuse_file(name, errno);
  struct stat status = {};
  if (::fstat(file.get(), &status) != 0) refuse_file(name, errno);
  if (!S_ISREG(status.st_mode)) throw Error(ErrorCode::bad_path, name + ": is not a regular file");
  const auto size = static_cast<std::uint64_t>(status.st_size);
  if (size > max_bytes) {
    throw Error(ErrorCode::over_budget, name + ": holds " + std::to_string(size) +
                                            " bytes; the limit is " + std::to_string(max_bytes));
  }
  return contents(name, file, static_cast<std::size_t>(size));
}

// Who in a scene uses one file.
struct Uses {
  std::vector<TextureSource*> textures = {};
  std::vector<MeshObject*> meshes = {};
};

std::map<std::string, Uses> uses_of_files(Scene& scene) {
  std::map<std::string, Uses> uses;
  for (TextureSource& texture : scene.textures) uses[texture.file].textures.push_back(&texture);
  for (Object& object : scene.objects) {
    if (auto* mesh = std::get_if<MeshObject>(&object.shape))
      uses[mesh->file].meshes.push_back(mesh);
  }
  return uses;
}

// Takes `amount` from what a scene may still have of something.
void spend(std::size_t& left, std::size_t amount, const std::string& name, const char* unit) {
  if (amount > left) {
    throw Error(ErrorCode::over_budget,
                name + ": with this file the scene has too many " + std::string(unit));
  }
  left -= amount;
}

std::size_t pixel_count(const Image& image) {
  return static_cast<std::size_t>(image.width()) * static_cast<std::size_t>(image.height());
}

}  // namespace

AssetReader folder_assets(std::filesystem::path folder, AssetLimits limits) {
  return [folder = std::move(folder), limits](const std::string& name) {
    return read_beneath(folder, name, limits.max_file_bytes);
  };
}

void load_assets(Scene& scene, const AssetReader& read, const AssetLimits& limits) {
  std::size_t triangles_left = limits.max_scene_triangles;
  std::size_t pixels_left = limits.max_scene_texture_pixels;
  for (auto& [file, uses] : uses_of_files(scene)) {
    const std::vector<std::byte> bytes = read(file);
    // Every user has a copy, which counts; what was decoded for another user is not decoded again.
    std::map<ColorSpace, const Image*> images;
    for (TextureSource* texture : uses.textures) {
      const Image*& image = images[texture->color_space];
      if (image == nullptr) {
        texture->image = decode_texture(file, bytes, texture->color_space, limits);
        image = &texture->image;
        spend(pixels_left, pixel_count(*image), file, "texture pixels");
      } else {
        spend(pixels_left, pixel_count(*image), file, "texture pixels");
        texture->image = *image;
      }
    }
    const Mesh* mesh = nullptr;
    for (MeshObject* object : uses.meshes) {
      if (mesh == nullptr) {
        object->mesh = decode_mesh(file, bytes, limits);
        mesh = &object->mesh;
        spend(triangles_left, mesh->triangles.size(), file, "triangles");
      } else {
        spend(triangles_left, mesh->triangles.size(), file, "triangles");
        object->mesh = *mesh;
      }
    }
    for (MeshObject* object : uses.meshes) {
      if (!object->crease_angle) continue;
      object->mesh = with_averaged_normals(object->mesh, *object->crease_angle);
    }
  }
}

}  // namespace fstop
