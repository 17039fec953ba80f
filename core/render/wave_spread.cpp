#include "core/render/wave_spread.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <memory>
#include <numbers>
#include <span>
#include <stop_token>

#include "core/optics/polygon_psf.h"
#include "core/post/far_halo.h"
#include "core/post/table_product.h"

namespace fstop {
namespace {

constexpr double kTau = 2.0 * std::numbers::pi;
constexpr int kGroups = 2;  // of layers, each summed by a thread of its own
constexpr double kMostPlane = 8e6;

// Margin beyond the frame that the point spread without its far halo needs.
double near_reach(double q, double largest_disc_px) {
  return 0.75 * largest_disc_px + 30.0 * q + 8.0;
}
double near_reach(const WaveOptics& optics, std::span<const double> defocuses) {
  double disc = 0.0;
  for (const double u : defocuses) disc = std::max(disc, std::abs(optics.disc_px(u)));
  return near_reach(optics.q(), disc);
}

// Pixels of one side of a transform.
double padded_side(int side, int guard, double reach) {
  return std::max(side + 2.0 * guard, side + guard + reach);
}

// tan^2 of the largest angle at which the frame and its guard see light; 0 for a lens.
double field_limit(const WaveOptics& optics, const WaveSpreader::Frame& frame) {
  if (!optics.is_pinhole()) return 0.0;
  const double reach = 0.5 * optics.pixel_pitch() / optics.image_distance();
  return std::pow(reach * (frame.width + 2 * frame.light_reach), 2) +
         std::pow(reach * (frame.height + 2 * frame.light_reach), 2);
}

}  // namespace

int WaveSpreader::cells_for(double q, int width, int height) {
  const double pixels = static_cast<double>(width) * height;
  int cells = 1;
  while (cells < 4 && cells * q < 8.0 && pixels * 4.0 * cells * cells <= kMostPlane) cells *= 2;
  return cells;
}

double WaveSpreader::plane_elements(double q, double largest_disc_px, int width, int height,
                                    int guard) {
  const double reach = near_reach(q, largest_disc_px);
  const double cells = cells_for(q, width, height);
  return padded_side(width, guard, reach) * padded_side(height, guard, reach) * cells * cells;
}

WaveSpreader::WaveSpreader(const WaveOptics& optics, const DepthNodes& nodes, const Frame& frame,
                           double tolerance, const RunControl& run)
    : optics_(optics),
      frame_(frame),
      defocuses_(nodes.defocuses().begin(), nodes.defocuses().end()),
      halo_(optics.halo_px()),
      tolerance_(tolerance) {
  const double reach = near_reach(optics, nodes.defocuses());
  const auto padded = [&](int side) {
    const double least = padded_side(side, frame.guard, reach);
    return fast_transform_length(static_cast<int>(std::ceil(least * frame.cells)));
  };
  plane_width_ = padded(frame.width);
  plane_height_ = padded(frame.height);
  halo_radius_ = std::max(16.0, 4.0 * optics.q());
  const double nyquist = 0.5 * frame.cells / optics.pixel_pitch();
  const std::size_t layers = nodes.defocuses().size();
  transfers_.resize(layers + 1);
  parallel_for(run, static_cast<int>(transfers_.size()), [&](int i) {
    const auto k = static_cast<std::size_t>(i);
    const double defocus = k < layers ? nodes.defocuses()[k] : 0.0;
    transfers_[k] = wave_transfer({.pupil = optics.pupil(defocus),
                                   .aperture = optics.is_pinhole() ? Aperture{} : optics.aperture(),
                                   .light = optics.light(),
                                   .scale = optics.scale(),
                                   .highest_frequency = nyquist * std::numbers::sqrt2,
                                   .field_limit = k < layers ? field_limit(optics, frame) : 0.0,
                                   .tolerance = tolerance,
                                   .stop = run.stop});
  });
  throw_if_stopped(run);
  for (std::size_t k = 0; k < layers; ++k) {
    const WaveTransfer& transfer = transfers_[k];
    transfer_error_ = std::max(transfer_error_, transfer.spectral_error + transfer.field_error);
    field_error_ = std::max(field_error_, transfer.field_error);
    model_error_ = std::max(model_error_, transfer.model_error);
    wavelengths_ = std::max(wavelengths_, transfer.wavelengths);
    disc_radius_px_.push_back(0.5 * optics.disc_px(nodes.defocuses()[k]));
  }
}

// Cells of the surveyed frame that a transform works on; light outside stays dark.
struct WaveSpreader::Region {
  int left = 0;
  int top = 0;
  int width = 0;
  int height = 0;
  double size() const { return static_cast<double>(width) * height; }
};

void WaveSpreader::add_light(const LightSum& light, const Region& region, int layer, int channel,
                             ImageView<float> plane) {
  light.first.add_to(plane, region.left, region.top, layer, channel, light.first_factor);
  if (light.second == nullptr) return;
  light.second->add_to(plane, region.left, region.top, layer, channel, light.second_factor);
}

WaveSpreader::Region WaveSpreader::whole() const {
  return {.width = plane_width_, .height = plane_height_};
}

// Where a layer's light falls with all that its point spread reaches, or all of the frame where
// that takes no more time.
WaveSpreader::Region WaveSpreader::region(const LightSum& light, int layer) const {
  LightLayers::Area area = light.first.area(layer);
  if (light.second != nullptr) {
    const LightLayers::Area more = light.second->area(layer);
    if (area.right == 0) {
      area = more;
    } else if (more.right > 0) {
      area = {std::min(area.left, more.left), std::min(area.top, more.top),
              std::max(area.right, more.right), std::max(area.bottom, more.bottom)};
    }
  }
  if (area.right == 0) return {};
  const std::array<double, 1> defocus = {defocuses_[static_cast<std::size_t>(layer)]};
  const int reach = static_cast<int>(std::ceil(near_reach(optics_, defocus))) * frame_.cells;
  const Region local{.left = area.left - reach,
                     .top = area.top - reach,
                     .width = fast_transform_length(area.right - area.left + 2 * reach),
                     .height = fast_transform_length(area.bottom - area.top + 2 * reach)};
  // A region is transformed back by itself, and its rows are added once more.
  return 2.5 * local.size() < plane_size() ? local : whole();
}

// Sums one channel of some layers, term by term, as spectra of a region.
class WaveSpreader::ChannelSum {
 public:
  ChannelSum(const WaveSpreader& owner, int channel, Wanted wanted, const Region& region)
      : waves(region.width, region.height),
        discs(wanted.discs ? region.width : 2, wanted.discs ? region.height : 2),
        owner_(owner),
        channel_(channel),
        wanted_(wanted),
        region_(region),
        sharp_(region.width, region.height) {}

  void add_layer(const LightSum& light, int layer, const std::stop_token& stop) {
    const WaveTransfer& transfer = owner_.transfers_[static_cast<std::size_t>(layer)];
    const std::size_t count = wanted_.field ? transfer.terms.size() : 1;
    for (std::size_t term = 0; term < count; ++term) {
      const int harmonic = transfer.terms[term].harmonic;
      if (stop.stop_requested()) return;
      add_term(light, layer, term, false, stop);
      if (harmonic > 0) add_term(light, layer, term, true, stop);
    }
  }

  SpectralPlane waves;
  SpectralPlane discs;

 private:
  void add_term(const LightSum& light, int layer, std::size_t term, bool sine,
                const std::stop_token& stop) {
    const WaveTransfer& transfer = owner_.transfers_[static_cast<std::size_t>(layer)];
    sharp_.clear();
    add_light(light, region_, layer, channel_, sharp_.view());
    const FieldTerm& field = transfer.terms[term];
    if (field != FieldTerm{}) weigh_by_field(field, sine);
    if (stop.stop_requested()) return;
    sharp_.transform();
    if (stop.stop_requested()) return;
    if (!transfer.polygon.empty()) {
      add_polygon(transfer, layer);
      return;
    }
    const RadialTable& table = transfer.tables[term][static_cast<std::size_t>(channel_)];
    if (field.harmonic > 0) {
      add_harmonic(table, field.harmonic, sine);
    } else if (term == 0) {
      add_radial(table.without_halo(halo_amplitude(), halo_decay()), waves);
      if (wanted_.discs) add_radial(disc_table(disc_radius(layer), highest_frequency()), discs);
    } else {
      add_radial(table, waves);
    }
  }

  double halo_amplitude() const {
    return owner_.halo_[static_cast<std::size_t>(channel_)] / owner_.halo_radius_;
  }
  double halo_decay() const { return kTau * owner_.halo_radius_ * owner_.optics_.pixel_pitch(); }
  // Metres; the sign is that of the defocus.
  double disc_radius(int layer) const {
    return owner_.disc_radius_px_[static_cast<std::size_t>(layer)] * owner_.optics_.pixel_pitch();
  }
  double highest_frequency() const {
    return 0.5 * std::hypot(frequency_steps().column * region_.width,
                            frequency_steps().row * region_.height);
  }

  void add_polygon(const WaveTransfer& transfer, int layer) {
    const auto channel = static_cast<std::size_t>(channel_);
    add_polar(transfer.polygon[channel].without_halo(halo_amplitude(), halo_decay()), waves);
    if (!wanted_.discs) return;
    // A far point (U < 0) shows the pupil upright in the picture.
    const double radius = -disc_radius(layer);
    const PolygonPupil pupil(owner_.optics_.aperture());
    const double highest = highest_frequency();
    const double step = std::min(0.02 / (kTau * std::abs(radius)), highest / 64.0);
    add_polar({owner_.optics_.aperture(), step, static_cast<int>(highest / step) + 3,
               [&](Vec2 nu) {
                 return pupil.field({kTau * radius * nu.x, kTau * radius * nu.y});
               }},
              discs);
  }

  void add_polar(const PolarTable& table, SpectralPlane& sum) const {
    fstop::add_polar(table, frequency_steps(), sharp_, sum);
  }

  FrequencySteps frequency_steps() const {
    const double cell = owner_.optics_.pixel_pitch() / owner_.frame_.cells;
    return {.column = 1.0 / (region_.width * cell), .row = 1.0 / (region_.height * cell)};
  }

  void add_radial(const RadialTable& table, SpectralPlane& sum) const {
    fstop::add_radial(table, frequency_steps(), sharp_, sum);
  }

  void add_harmonic(const RadialTable& table, int harmonic, bool sine) {
    fstop::add_harmonic(table, {.order = harmonic, .sine = sine}, frequency_steps(), sharp_, waves);
  }

  // t^power cos or sin of 2 m phi at every cell: polynomials in the field position.
  void weigh_by_field(const FieldTerm& field, bool sine) {
    const Frame& frame = owner_.frame_;
    const int width = (frame.width + 2 * frame.guard) * frame.cells;
    const int height = (frame.height + 2 * frame.guard) * frame.cells;
    const double unit =
        owner_.optics_.pixel_pitch() / (owner_.optics_.image_distance() * frame.cells);
    for (int row = 0; row < region_.height; ++row) {
      const double y = (row + region_.top + 0.5 - 0.5 * height) * unit;
      float* line = sharp_.view().at(0, row);
      for (int column = 0; column < region_.width; ++column) {
        if (line[column] == 0.0F) continue;
        const std::complex<double> place((column + region_.left + 0.5 - 0.5 * width) * unit, y);
        const std::complex<double> square = place * place;
        std::complex<double> power = 1.0;
        for (int k = 0; k < field.harmonic; ++k) power *= square;
        double weight = sine ? power.imag() : power.real();
        for (int k = field.harmonic; k < field.power; ++k) weight *= std::norm(place);
        line[column] *= static_cast<float>(weight);
      }
    }
  }

  const WaveSpreader& owner_;
  int channel_;
  Wanted wanted_;
  Region region_;
  SpectralPlane sharp_;
};

// One channel of some layers: spectra of those all over the frame, and the sum of the others.
class WaveSpreader::GroupSum {
 public:
  GroupSum(const WaveSpreader& owner, int channel, Wanted wanted)
      : owner_(owner), channel_(channel), wanted_(wanted) {}

  void add_layer(const LightSum& light, int layer, const std::stop_token& stop) {
    const Region region = owner_.region(light, layer);
    if (region.width == 0) return;
    if (region.size() == owner_.plane_size()) {
      if (!wide_) {
        wide_ = std::make_unique<ChannelSum>(owner_, channel_, wanted_, owner_.whole());
      }
      wide_->add_layer(light, layer, stop);
      return;
    }
    ChannelSum local(owner_, channel_, wanted_, region);
    local.add_layer(light, layer, stop);
    if (stop.stop_requested()) return;
    place(local.waves, region, waves_);
    if (wanted_.discs) place(local.discs, region, discs_);
  }

  // Adds the group's waves, or its discs, to `sum`.
  void add_waves(SpectralPlane& sum) {
    if (wide_) add_wide(wide_->waves, sum);
    if (waves_) sum += *waves_;
  }
  void add_discs(SpectralPlane& sum) {
    if (wide_) add_wide(wide_->discs, sum);
    if (discs_) sum += *discs_;
  }

 private:
  static void add_wide(SpectralPlane& spectrum, SpectralPlane& sum) {
    spectrum.invert();
    sum += spectrum;
  }

  void place(SpectralPlane& local, const Region& region, std::unique_ptr<SpectralPlane>& sum) {
    local.invert();
    if (!sum) sum = std::make_unique<SpectralPlane>(owner_.plane_width_, owner_.plane_height_);
    const int from = std::max(0, -region.left);
    const int to = std::min(region.width, owner_.plane_width_ - region.left);
    for (int y = std::max(0, -region.top);
         y < std::min(region.height, owner_.plane_height_ - region.top); ++y) {
      const float* in = local.view().at(0, y);
      float* out = sum->view().at(0, y + region.top);
      for (int x = from; x < to; ++x) out[x + region.left] += in[x];
    }
  }

  const WaveSpreader& owner_;
  int channel_;
  Wanted wanted_;
  std::unique_ptr<ChannelSum> wide_ = {};
  std::unique_ptr<SpectralPlane> waves_ = {};
  std::unique_ptr<SpectralPlane> discs_ = {};
};

namespace {

// Writes the mean of a pixel's cells.
void collect(const SpectralPlane& plane, const WaveSpreader::Frame& frame, int channel,
             Image& image) {
  const int cells = frame.cells;
  const float share = 1.0F / static_cast<float>(cells * cells);
  const int offset = frame.guard * cells;
  for (int y = 0; y < frame.height; ++y) {
    for (int x = 0; x < frame.width; ++x) {
      float sum = 0.0F;
      for (int j = 0; j < cells; ++j) {
        const float* line = plane.view().at(offset + x * cells, offset + y * cells + j);
        for (int i = 0; i < cells; ++i) sum += line[i];
      }
      image.at(x, y)[channel] = sum * share;
    }
  }
}

}  // namespace

SpreadLight WaveSpreader::spread(const LightSum& light, bool with_discs,
                                 const RunControl& run) const {
  return spread(light, Wanted{.discs = with_discs}, run);
}

Image WaveSpreader::spread_roughly(const LightSum& light, const RunControl& run) const {
  return spread(light, Wanted{.field = false}, run).waves;
}

SpreadLight WaveSpreader::spread(const LightSum& light, Wanted wanted,
                                 const RunControl& run) const {
  SpreadLight result{.waves = Image(frame_.width, frame_.height, 3)};
  if (wanted.discs) result.discs = Image(frame_.width, frame_.height, 3);
  // Large planes one channel after another: their memory is what limits a picture.
  const bool one_by_one = plane_size() > kLargePlane;
  const int channels_at_once = one_by_one ? 1 : 3;
  for (int channel = 0; channel < 3; channel += channels_at_once) {
    spread_channels(light, wanted, channel, channels_at_once, result, run);
  }
  return result;
}

void WaveSpreader::spread_channels(const LightSum& light, Wanted wanted, int first, int count,
                                   SpreadLight& result, const RunControl& run) const {
  std::vector<GroupSum> groups;
  for (int task = 0; task < count * kGroups; ++task) {
    groups.emplace_back(*this, first + task / kGroups, wanted);
  }
  parallel_for(run, count * kGroups, [&](int task) {
    const int layers = static_cast<int>(transfers_.size()) - 1;
    for (int layer = task % kGroups; layer < layers; layer += kGroups) {
      if (run.stop.stop_requested()) return;
      groups[static_cast<std::size_t>(task)].add_layer(light, layer, run.stop);
    }
  });
  throw_if_stopped(run);
  // Waves, discs and halo of each channel apart: enough tasks for some threads.
  Image halo(frame_.width, frame_.height, count);
  parallel_for(run, 3 * count, [&](int task) {
    const int own = task % count;  // of the channels at work
    const int channel = first + own;
    const auto joined = [&](void (GroupSum::*add)(SpectralPlane&), Image& image) {
      SpectralPlane sum(plane_width_, plane_height_);
      for (int group = 0; group < kGroups; ++group) {
        (groups[static_cast<std::size_t>(own * kGroups + group)].*add)(sum);
      }
      collect(sum, frame_, channel, image);
    };
    if (task < count) {
      joined(&GroupSum::add_waves, result.waves);
    } else if (task < 2 * count) {
      add_halo(light, channel, own, halo);
    } else if (wanted.discs) {
      joined(&GroupSum::add_discs, result.discs);
    }
  });
  throw_if_stopped(run);
  for (int y = 0; y < frame_.height; ++y) {
    for (int x = 0; x < frame_.width; ++x) {
      for (int own = 0; own < count; ++own) {
        result.waves.at(x, y)[first + own] += halo.at(x, y)[own];
      }
    }
  }
}

Image WaveSpreader::spread_in_focus(const Image& picture, const RunControl& run) const {
  Image result(frame_.width, frame_.height, 3);
  // Beyond the frame the picture goes on as at its border.
  const int margin = static_cast<int>(
      std::min(near_reach(optics_, {}), 0.5 * std::max(frame_.width, frame_.height) + 8.0));
  const int width = fast_transform_length(frame_.width + 2 * margin);
  const int height = fast_transform_length(frame_.height + 2 * margin);
  const FrequencySteps steps{.column = 1.0 / (width * optics_.pixel_pitch()),
                             .row = 1.0 / (height * optics_.pixel_pitch())};
  const WaveTransfer& focus = transfers_.back();
  parallel_for(run, 3, [&](int channel) {
    SpectralPlane sharp(width, height);
    for (int y = 0; y < height; ++y) {
      const int row = std::clamp(y - margin, 0, frame_.height - 1);
      for (int x = 0; x < width; ++x) {
        const int column = std::clamp(x - margin, 0, frame_.width - 1);
        *sharp.view().at(x, y) = picture.at(column, row)[channel];
      }
    }
    sharp.transform();
    SpectralPlane sum(width, height);
    const auto c = static_cast<std::size_t>(channel);
    if (focus.polygon.empty()) {
      add_radial(focus.tables[0][c], steps, sharp, sum);
    } else {
      add_polar(focus.polygon[c], steps, sharp, sum);
    }
    sum.invert();
    collect(sum, {.width = frame_.width, .height = frame_.height, .guard = margin}, channel,
            result);
  });
  return result;
}

void WaveSpreader::add_halo(const LightSum& light, int channel, int own, Image& halo) const {
  Image fine((frame_.width + 2 * frame_.guard) * frame_.cells,
             (frame_.height + 2 * frame_.guard) * frame_.cells, 1);
  for (int layer = 0; layer + 1 < static_cast<int>(transfers_.size()); ++layer) {
    add_light(light, Region{.width = fine.width(), .height = fine.height()}, layer, channel,
              fine.view());
  }
  const FarHalo spread(fine, frame_.cells, halo_[static_cast<std::size_t>(channel)], halo_radius_);
  for (int y = 0; y < frame_.height; ++y) {
    for (int x = 0; x < frame_.width; ++x) {
      halo.at(x, y)[own] = spread.at(x + frame_.guard + 0.5, y + frame_.guard + 0.5);
    }
  }
}

}  // namespace fstop
