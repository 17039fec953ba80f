#include <bit>
#include <cstring>
#include <type_traits>

#include "core/error.h"
#include "core/render/adaptive.h"
#include "core/render/parts.h"

namespace fstop {
namespace {

static_assert(std::endian::native == std::endian::little, "bytes go as this machine has them");
static_assert(sizeof(PartSums) == (3 * kBlockPixels + 1) * sizeof(float), "without gaps");
static_assert(sizeof(SampleRange) == 2 * sizeof(std::uint32_t), "without gaps");

constexpr std::string_view kOrderName = "fstop-part-order";
constexpr std::string_view kPartName = "fstop-part-sums";
constexpr std::uint32_t kVersion = 1;
constexpr std::uint32_t kLongestMethod = 64;
constexpr std::uint32_t kWidest = 1U << 24;  // pixels

template <typename T>
void append(std::string& bytes, const T& value) {
  static_assert(std::is_trivially_copyable_v<T>);
  bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}
template <typename T>
void append_all(std::string& bytes, const std::vector<T>& values) {
  static_assert(std::is_trivially_copyable_v<T>);
  bytes.append(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T));
}

void require(bool holds, const char* what) {
  if (!holds) throw Error(ErrorCode::invalid_request, std::string("a picture's part: ") + what);
}

class Reader {
 public:
  explicit Reader(std::string_view bytes) : rest_(bytes) {}

  std::string_view take(std::size_t count) {
    require(count <= rest_.size(), "its bytes end early");
    const std::string_view taken = rest_.substr(0, count);
    rest_.remove_prefix(count);
    return taken;
  }
  template <typename T>
  T number() {
    T value = {};
    std::memcpy(&value, take(sizeof value).data(), sizeof value);
    return value;
  }
  // What is allocated is there.
  template <typename T>
  std::vector<T> numbers(std::uint64_t count) {
    require(count <= rest_.size() / sizeof(T), "its bytes end early");
    std::vector<T> values(count);
    const std::string_view bytes = take(count * sizeof(T));
    if (!values.empty()) std::memcpy(values.data(), bytes.data(), bytes.size());
    return values;
  }
  void begin(std::string_view name) {
    require(take(name.size()) == name, "other bytes than these");
    require(number<std::uint32_t>() == kVersion, "its form has another version");
  }
  void end() const { require(rest_.empty(), "it has more bytes than it says"); }

 private:
  std::string_view rest_;
};

// FNV-1a: what a part belongs to, not who made it.
std::uint64_t fingerprint(std::string_view bytes) {
  std::uint64_t hash = 0xcbf29ce484222325U;
  for (const char c : bytes) hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3U;
  return hash;
}

std::size_t tiles_of(const BlockGrid& grid) {
  return static_cast<std::size_t>(grid.tile_columns()) * static_cast<std::size_t>(grid.tile_rows());
}

// One bit a tile; none where no tile is interleaved.
std::vector<std::uint8_t> bits_of(const std::vector<std::uint8_t>& flags) {
  std::vector<std::uint8_t> bits((flags.size() + 7) / 8);
  for (std::size_t i = 0; i < flags.size(); ++i) {
    if (flags[i] != 0) bits[i / 8] = static_cast<std::uint8_t>(bits[i / 8] | 1U << (i % 8));
  }
  return bits;
}

std::vector<std::uint8_t> flags_of(const std::vector<std::uint8_t>& bits, std::size_t count) {
  std::vector<std::uint8_t> flags(count);
  for (std::size_t i = 0; i < count; ++i) flags[i] = bits[i / 8] >> (i % 8) & 1U;
  return flags;
}

void require_in_domain(const PartOrder& order) {
  const std::size_t all = order.grid().count();
  require(order.blocks() > 0 && order.blocks() <= kMostPartBlocks, "it has no blocks or too many");
  require(order.first_block < all && order.blocks() <= all - order.first_block,
          "its blocks lie outside the picture");
  for (const auto& ranges : order.samples) {
    for (const SampleRange& range : ranges)
      require(range.first <= range.end && range.end <= kMostSamples, "it has too many samples");
  }
}

}  // namespace

std::string bytes_of(const PartOrder& order) {
  std::string bytes(kOrderName);
  append(bytes, kVersion);
  append(bytes, static_cast<std::uint32_t>(order.method.size()));
  bytes += order.method;
  append(bytes, order.sharp_samples);
  append(bytes, static_cast<std::uint32_t>(order.width));
  append(bytes, static_cast<std::uint32_t>(order.height));
  append(bytes, std::uint64_t{order.interleaved.size()});
  append_all(bytes, bits_of(order.interleaved));
  append(bytes, std::uint64_t{order.first_block});
  append(bytes, std::uint64_t{order.blocks()});
  for (const auto& ranges : order.samples) append_all(bytes, ranges);
  return bytes;
}

PartOrder part_order_of(std::string_view bytes) {
  Reader reader(bytes);
  reader.begin(kOrderName);
  PartOrder order;
  const auto length = reader.number<std::uint32_t>();
  require(length <= kLongestMethod, "its method's name is too long");
  order.method = reader.take(length);
  order.sharp_samples = reader.number<std::uint32_t>();
  require(order.sharp_samples <= kMostSamples, "it has too many samples");
  const auto width = reader.number<std::uint32_t>();
  const auto height = reader.number<std::uint32_t>();
  require(width >= 1 && width <= kWidest && height >= 1 && height <= kWidest,
          "its picture has no such size");
  order.width = static_cast<int>(width);
  order.height = static_cast<int>(height);
  const auto tiles = reader.number<std::uint64_t>();
  require(tiles == 0 || tiles == tiles_of(order.grid()), "it has other tiles than its picture");
  order.interleaved = flags_of(reader.numbers<std::uint8_t>((tiles + 7) / 8), tiles);
  order.first_block = reader.number<std::uint64_t>();
  const auto blocks = reader.number<std::uint64_t>();
  for (auto& ranges : order.samples) ranges = reader.numbers<SampleRange>(blocks);
  reader.end();
  require_in_domain(order);
  return order;
}

std::string bytes_of(const TracedPart& part, const PartOrder& order) {
  std::string bytes(kPartName);
  append(bytes, kVersion);
  append(bytes, fingerprint(bytes_of(order)));
  append(bytes, part.rays);
  append(bytes, part.cut_squares);
  append(bytes, std::uint64_t{part.sums.size()});
  append_all(bytes, part.sums);
  return bytes;
}

TracedPart traced_part_of(std::string_view bytes, const PartOrder& order) {
  Reader reader(bytes);
  reader.begin(kPartName);
  require(reader.number<std::uint64_t>() == fingerprint(bytes_of(order)),
          "it belongs to another order");
  TracedPart part;
  part.rays = reader.number<std::uint64_t>();
  part.cut_squares = reader.number<std::uint64_t>();
  const auto count = reader.number<std::uint64_t>();
  require(count == order.sums(), "it has other blocks than its order");
  part.sums = reader.numbers<PartSums>(count);
  reader.end();
  // Not NaN: no smallest distance is.
  for (const PartSums& sums : part.sums)
    require(sums.least_defocus >= 0.0F, "it has a distance below 0");
  return part;
}

}  // namespace fstop
