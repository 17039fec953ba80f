#include "api/render_id.h"

#include <algorithm>
#include <array>
#include <memory>

#include <openssl/evp.h>

#include "core/error.h"

namespace fstop::api {
namespace {

/// SHA-256 over fields, each preceded by its length: no two lists of fields have one text.
class FieldHash {
 public:
  FieldHash() : context_(EVP_MD_CTX_new(), EVP_MD_CTX_free) {
    check(context_ != nullptr && EVP_DigestInit_ex(context_.get(), EVP_sha256(), nullptr) == 1);
  }
  FieldHash& add(std::span<const std::byte> bytes) {
    const std::string length = std::to_string(bytes.size()) + ":";
    return raw(std::as_bytes(std::span(length))).raw(bytes);
  }
  FieldHash& add(std::string_view text) { return add(std::as_bytes(std::span(text))); }
  FieldHash& raw(std::span<const std::byte> bytes) {
    check(EVP_DigestUpdate(context_.get(), bytes.data(), bytes.size()) == 1);
    return *this;
  }
  std::string hex() {
    constexpr std::string_view kDigits = "0123456789abcdef";
    std::array<unsigned char, EVP_MAX_MD_SIZE> digest = {};
    unsigned int length = 0;
    check(EVP_DigestFinal_ex(context_.get(), digest.data(), &length) == 1);
    std::string text;
    for (unsigned int i = 0; i < length; ++i) {
      text += kDigits[digest[i] >> 4];
      text += kDigits[digest[i] & 15];
    }
    return text;
  }

 private:
  static void check(bool worked) {
    if (!worked) throw Error(ErrorCode::internal, "SHA-256 failed");
  }
  std::unique_ptr<EVP_MD_CTX, decltype(&EVP_MD_CTX_free)> context_;
};

}  // namespace

std::string sha256_hex(std::span<const std::byte> bytes) { return FieldHash().raw(bytes).hex(); }

std::string sha256_hex(std::string_view text) { return sha256_hex(std::as_bytes(std::span(text))); }

std::string scene_hash(std::string_view canonical_scene, std::span<const AssetBytes> assets) {
  std::vector<const AssetBytes*> sorted;
  for (const AssetBytes& asset : assets) sorted.push_back(&asset);
  std::ranges::sort(sorted, {}, &AssetBytes::name);
  FieldHash hash;
  hash.add(canonical_scene);
  for (const AssetBytes* asset : sorted) hash.add(asset->name).add(asset->bytes);
  return hash.hex();
}

std::string render_id(std::string_view canonical_request, std::string_view scene_hash,
                      std::string_view engine_version) {
  return FieldHash().add(canonical_request).add(scene_hash).add(engine_version).hex();
}

std::string_view engine_version() { return "fstop/" FSTOP_VERSION; }

bool is_render_id(std::string_view text) {
  const auto is_digit = [](char c) { return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f'); };
  return text.size() == 64 && std::ranges::all_of(text, is_digit);
}

}  // namespace fstop::api
