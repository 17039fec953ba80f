#include "server/file_calls.h"

#include <string>
#include <utility>

#include "api/cell_json.h"
#include "api/render_id.h"
#include "server/reply_head.h"

namespace fstop::server {
namespace {

namespace asio = boost::asio;

constexpr int kDiskThreads = 8;
constexpr int kDiskNiceness = 0;

const std::string& checked_hash(const Call& call) {
  const std::string& hash = call.parameters[0];
  if (!api::is_sha256(hash)) {
    throw Refusal(http::status::unprocessable_entity, "bad-name",
                  "a file's name is the SHA-256 of its bytes: 64 lower-case hexadecimal digits");
  }
  return hash;
}

}  // namespace

FileCalls::FileCalls(ContentStore& store) : store_(store), disk_(kDiskThreads, kDiskNiceness) {}

void FileCalls::add_to(Routes& routes) {
  routes.add(http::verb::get, "/v1/files/{sha256}", [this](Call& call) { return get(call); });
  routes.add(http::verb::put, "/v1/files/{sha256}", [this](Call& call) { return put(call); });
}

asio::awaitable<Reply> FileCalls::get(Call& call) {
  const auto read = [this, &call] {
    const std::string& hash = checked_hash(call);
    std::optional<std::string> bytes = store_.get(hash);
    if (!bytes) throw Refusal(http::status::not_found, "not-found", "there is no such file");
    Reply reply =
        tagged_reply(call.request, "application/octet-stream", etag_of(hash), std::move(*bytes));
    reply.set("Cache-Control", "private, max-age=31536000, immutable");
    return reply;
  };
  co_return co_await disk_.run(read);
}

asio::awaitable<Reply> FileCalls::put(Call& call) {
  const auto keep = [this, &call] {
    const std::string& hash = checked_hash(call);
    const std::string& bytes = call.request.body;
    const std::string actual = api::sha256_hex(bytes);
    if (actual != hash) {
      throw Refusal(
          http::status::unprocessable_entity, "hash-differs",
          "the SHA-256 of the " + std::to_string(bytes.size()) + " bytes that came is " + actual);
    }
    store_.put(bytes);
    // Whether it was there before is nobody's concern: it is there now, on the disk.
    Reply reply{.status = http::status::no_content};
    reply.set("Location", "/v1/files/" + hash);
    reply.set("ETag", etag_of(hash));
    return reply;
  };
  co_return co_await disk_.run(keep);
}

}  // namespace fstop::server
