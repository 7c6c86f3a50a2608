// Clouds as files that people exchange: PLY and PCD (each ascii or binary little-endian) and XYZ (one point a line), read and
// written by bounded readers of our own. Points in the order of the file, in the unit of the file.
#pragma once

#include <absl/status/statusor.h>

#include <cstdint>
#include <string>
#include <string_view>

#include "metrology/frames/pose.h"

namespace sixpoint::cli {

inline constexpr std::uint64_t kGreatestCloudBytes = 1u << 30;
inline constexpr std::int64_t kGreatestCloudPointCount = 20000000;

// `name` is for the messages. INVALID_ARGUMENT names the file, the line or point, the value and what was wanted: a broken
// header, a count that the content does not hold, a coordinate that is not finite, no points. Memory is bounded by the
// bytes given, whatever the header claims.
absl::StatusOr<metrology::Points> ParsePly(const std::string& name, std::string_view bytes);
absl::StatusOr<metrology::Points> ParsePcd(const std::string& name, std::string_view bytes);
// x y z, separated by spaces, tabs, commas or semicolons; further columns are ignored; lines that start with # or // too.
absl::StatusOr<metrology::Points> ParseXyz(const std::string& name, std::string_view bytes);

// By the ending of its name: .ply, .pcd, .xyz, .txt, .csv or .drc (Draco, checked for its point count before decoding).
absl::StatusOr<metrology::Points> ReadCloud(const std::string& path);

// PLY: binary little-endian doubles. XYZ: shortest text that reads back as the same double.
std::string ToPly(const metrology::Points& points);
std::string ToXyz(const metrology::Points& points);
// How a file of that name is written: .ply or .xyz; "-", standard output, as .xyz.
using CloudWriter = std::string (*)(const metrology::Points& points);
absl::StatusOr<CloudWriter> CloudWriterFor(const std::string& path);

}  // namespace sixpoint::cli
