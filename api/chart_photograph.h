#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>

#include "api/limits.h"
#include "api/scene_store.h"
#include "core/film/image.h"
#include "core/parallel.h"
#include "core/study/verification.h"

namespace fstop::api {

/// The body of POST /v1/renders that asks for `shot` as EXR: camera, size, quality and effects, the
/// scene inline (quads of unlit emission). What it leaves out has the contract's defaults.
/// Throws: Error{internal} for a scene of other things.
std::string chart_request_text(const ChartShot& shot);

/// The colour of a finished EXR file, read with the bounds that foreign files have.
/// Throws: Error{bad_image}.
Image finished_picture(std::span<const std::byte> bytes, const Limits& limits);

/// The picture of any render request, made by this program: the text is parsed, rendered, encoded
/// and decoded, so that what is measured is what a client would get. Scenes as load_beside has
/// them. Throws: as parse_render_request, load_beside, simulate and finished_picture.
Image picture_here(std::string_view request, const std::filesystem::path& folder,
                   const SceneStore& store, const Limits& limits, const RunControl& run);

}  // namespace fstop::api
