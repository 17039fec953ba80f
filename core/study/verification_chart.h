#pragma once

#include "core/study/verification.h"

namespace fstop {

/// The edge's bright side: this far anticlockwise from +x of the raster's x (towards +y, down).
inline constexpr double kChartSlant = 5.0 * 0.017453292519943295;  // radians

/// The check's camera before a sensor of `side` x `side` pixels of `pitch`, its shot otherwise
/// empty: the effects off that are not asked for.
SimulationSpec chart_shot(const VerificationCheck& check, Length pitch, int width, int height);

/// Distance from the pupil to the sensor, by nominal numbers.
double chart_sensor_distance(const CameraSpec& camera);

/// A half-plane of radiance 1 at `depth` before black, its edge through the axis, slanted by
/// kChartSlant; it reaches beyond everything that the pupil sees.
Scene edge_chart(const SimulationSpec& shot, Length depth);

/// A strip of radiance 1 between two parallel edges of that slant, `width` apart, about the axis.
Scene strip_chart(const SimulationSpec& shot, Length depth, Length width);

/// A wall of radiance 1 all over.
Scene wall_chart(const SimulationSpec& shot, Length depth);

/// A square of radiance 1 on the axis, `side` wide.
Scene point_chart(Length depth, Length side);

}  // namespace fstop
