// The path of a request: which route it takes, and what of the disk it can reach.
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <set>
#include <string>

#include "server/routes.h"
#include "server/static_files.h"
#include "tests/fuzz/fuzz_target.h"

namespace fstop::test {
namespace {

namespace fs = std::filesystem;
using server::Refusal;

// A page with files beside it that nobody may have.
class Folder {
 public:
  Folder() {
    std::string pattern = (fs::temp_directory_path() / "fstop-fuzz-XXXXXX").string();
    require(::mkdtemp(pattern.data()) != nullptr, "a temporary folder");
    path_ = pattern;
    fs::create_directories(path_ / "web/assets");
    fs::create_directories(path_ / "web/.git");
    write("web/index.html", "page");
    write("web/assets/a.js", "script");
    write("web/assets/a b.css", "style");
    for (const char* hidden : {"secret", "web/.env", "web/.git/config", "web/a\\b"})
      write(hidden, "SECRET");
    fs::create_symlink("../secret", path_ / "web/link");
    fs::create_directory_symlink("..", path_ / "web/up");
  }
  ~Folder() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;
  std::string web() const { return (path_ / "web").string(); }

 private:
  void write(const std::string& name, std::string_view content) const {
    std::ofstream(path_ / name) << content;
  }
  fs::path path_;
};

server::Routes routes() {
  server::Routes table;
  for (const char* pattern : {"/v1/renders/{id}/outputs/{name}", "/v1/scenes/{name}", "/livez"})
    table.add(server::http::verb::get, pattern, {});
  table.set_files({});
  return table;
}

void require_is_public(const std::string& content) {
  static const std::set<std::string> contents = {"page", "script", "style"};
  require(contents.contains(content), "only the page's files are given out");
}

}  // namespace
}  // namespace fstop::test

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace fstop::test;
  using namespace fstop::server;
  static const Folder folder;
  static const StaticFiles files(folder.web());
  static const Routes table = routes();
  const std::string path = "/" + std::string(Input(data, size).text());
  try {
    for (const std::string& parameter : table.match(http::verb::get, path).parameters)
      require(!parameter.empty(), "what stands for braces is not empty");
    (void)table.allowed(path);
  } catch (const Refusal&) {
  }
  try {
    Request request;
    request.verb = http::verb::get;
    const Reply reply = files.reply(request, path);
    const auto bytes = reply.bytes();
    require_is_public({bytes.data(), bytes.size()});
  } catch (const Refusal& refusal) {
    const auto status = static_cast<unsigned>(refusal.status());
    require(status == 400 || status == 404, "paths are refused by 400 or 404");
  }
  return 0;
}
