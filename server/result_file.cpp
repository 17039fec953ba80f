#include "server/result_file.h"

#include <cstring>
#include <optional>
#include <utility>

#include "api/render_id.h"
#include "api/render_request.h"
#include "core/error.h"
#include "server/render_cache.h"

namespace fstop::server {
namespace {

constexpr std::string_view kFormat = "fstop-result/1 ";
constexpr std::size_t kHashDigits = 64;

class Writer {
 public:
  template <typename Number>
  void number(Number value) {
    text_.append(reinterpret_cast<const char*>(&value), sizeof value);
  }
  void text(std::string_view value) {
    number(static_cast<std::uint64_t>(value.size()));
    text_.append(value);
  }
  void image(Output output, const Image& image) {
    text(output_name(output));
    for (const int size : {image.width(), image.height(), image.channels()})
      number(static_cast<std::int32_t>(size));
    text_.append(reinterpret_cast<const char*>(image.pixels().data()),
                 image.pixels().size() * sizeof(float));
  }
  std::string take() { return std::move(text_); }

 private:
  std::string text_ = {};
};

// Reads what Writer wrote; once something is missing all that follows is empty.
class Reader {
 public:
  explicit Reader(std::string_view bytes) : rest_(bytes) {}
  bool is_whole() const { return whole_; }
  bool is_at_end() const { return whole_ && rest_.empty(); }

  template <typename Number>
  Number number() {
    Number value = {};
    const std::string_view bytes = take(sizeof value);
    if (whole_) std::memcpy(&value, bytes.data(), sizeof value);
    return value;
  }
  std::string text() {
    const auto size = number<std::uint64_t>();
    return std::string(take(size));
  }
  Image image() {
    const auto width = number<std::int32_t>();
    const auto height = number<std::int32_t>();
    const auto channels = number<std::int32_t>();
    whole_ = whole_ && width > 0 && height > 0 && channels > 0 && channels <= 4;
    if (!whole_) return {};
    const std::uint64_t floats = static_cast<std::uint64_t>(width) *
                                 static_cast<std::uint64_t>(height) *
                                 static_cast<std::uint64_t>(channels);
    const std::string_view bytes = take(floats * sizeof(float));
    if (!whole_) return {};
    Image image(width, height, channels);
    std::memcpy(image.pixels().data(), bytes.data(), bytes.size());
    return image;
  }

 private:
  std::string_view take(std::uint64_t count) {
    whole_ = whole_ && count <= rest_.size();
    if (!whole_) return {};
    const std::string_view bytes = rest_.substr(0, count);
    rest_.remove_prefix(count);
    return bytes;
  }
  std::string_view rest_;
  bool whole_ = true;
};

bool read_images(Reader& reader, Photograph& photograph) {
  const auto count = reader.number<std::uint32_t>();
  for (std::uint32_t i = 0; i < count && reader.is_whole(); ++i) {
    const auto output = output_of(reader.text());
    Image image = reader.image();
    if (!output || !reader.is_whole()) return false;
    (*output == Output::color ? photograph.color : photograph.layers[*output]) = std::move(image);
  }
  return reader.is_at_end() && !photograph.color.empty();
}

}  // namespace

std::string result_bytes(const StoredRender& render) {
  Writer writer;
  writer.text(render.id);
  writer.text(render.photograph.report.method);
  const ImageError& error = render.photograph.report.error;
  for (const double value : {error.estimate, error.upper_95, render.timing.render_ms,
                             render.timing.queue_ms, render.timing.encode_ms})
    writer.number(value);
  writer.text(render.normalised);
  writer.text(render.report);
  writer.number(static_cast<std::uint32_t>(1 + render.photograph.layers.size()));
  writer.image(Output::color, render.photograph.color);
  for (const auto& [output, image] : render.photograph.layers) writer.image(output, image);
  const std::string content = writer.take();
  std::string bytes(kFormat);
  bytes += api::sha256_hex(std::string_view(content)) + '\n';
  return bytes += content;
}

std::shared_ptr<StoredRender> result_of(std::string_view bytes, std::string_view id,
                                        const api::Limits& limits) {
  const std::size_t head = kFormat.size() + kHashDigits + 1;
  if (bytes.size() < head || !bytes.starts_with(kFormat)) return nullptr;
  const std::string_view content = bytes.substr(head);
  if (api::sha256_hex(content) != bytes.substr(kFormat.size(), kHashDigits)) return nullptr;
  Reader reader(content);
  auto render = std::make_shared<StoredRender>();
  render->id = reader.text();
  render->photograph.report.method = reader.text();
  ImageError& error = render->photograph.report.error;
  for (double* value : {&error.estimate, &error.upper_95, &render->timing.render_ms,
                        &render->timing.queue_ms, &render->timing.encode_ms})
    *value = reader.number<double>();
  render->normalised = reader.text();
  render->report = reader.text();
  render->photograph.report.alpha_error = api::alpha_error_of(render->report);
  if (render->id != id || !read_images(reader, render->photograph)) return nullptr;
  try {
    render->spec =
        api::parse_render_request(render->normalised, limits, api::SceneNames::stored_only).spec;
  } catch (const Error&) {
    return nullptr;
  }
  return render;
}

}  // namespace fstop::server
