// A post-processor as data: how a control wants its programs to look, from which the template of a machining model is written
// (docs/nc_template.md, post-processors). What it writes is moved onto blades, read back and proven as any template is.
#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <array>
#include <optional>
#include <string>
#include <vector>

namespace sixpoint::metrology {

inline constexpr int kLeastPostDecimals = 4, kMostPostDecimals = 9;  // as nc_program.h keeps them
inline constexpr int kLeastDirectionDecimals = 6;  // else a direction is 3e-5 deg beside what was meant
inline constexpr std::size_t kMostSectionBytes = 8192;

// Sections are lines of blocks. In braces: {x} {y} {z} {a} {b}, the words of the hole or pose, a and b those of the axis on the bed and of the
// one that it carries; {v}, the words of its direction; and texts: {operation} {group} {hole} {path} {number} {tool} {feed} {depth} {diameter}
// {length}. A line that has words of the hole is marked.
struct PostProcessor {
  std::array<std::string, 5> axis_words = {"X", "Y", "Z", "A", "B"};  // as NcFrame's
  int linear_decimals = 4, rotary_decimals = 4, direction_decimals = 7;
  bool explicit_plus = false;
  bool directions = false;           // the control has them (TRAORI, ORIWKS); {v} is refused else
  bool semicolon_comments = false;   // else in brackets
  bool leaves_out_repeated = false;  // within a hole or a path: G0, G1, G90, G91, F and words that are in force already
  int first_number = 0, number_step = 0;  // of blocks, N; step 0: none
  std::string program_start, operation_start, hole, path_start, path_pose, path_end, operation_end, program_end;
};

struct PostHole {
  std::string group, hole;
  double depth_mm = 0;
};
// From its first pose, which path_start is of.
struct PostPath {
  std::string path;
  int pose_count = 0;
};
struct PostOperation {
  std::string operation;
  std::optional<int> tool_number;
  std::optional<double> feed_mm_min;
  double electrode_diameter_mm = 0, electrode_length_mm = 0;
  std::vector<PostHole> holes;
  std::vector<PostPath> paths;
};

// INVALID_ARGUMENT for each thing that a post-processor cannot have: axis words twice or of letters that mean something else, decimals, numbers,
// text that is no printable ASCII, a marker of its own, a brace that names nothing, {v} where directions are not there or without {x} {y} {z},
// and a text that the section's place does not have ({hole} in program_start).
absl::Status CheckPostProcessor(const PostProcessor& post);

// The template of operations in their order. post: let pass. INVALID_ARGUMENT: a section that the operations need is empty, one that says
// {tool} or {feed} of an operation that states none, or more than most_bytes.
absl::StatusOr<std::string> WriteTemplate(const PostProcessor& post, const std::vector<PostOperation>& operations,
                                          std::size_t most_bytes);

}  // namespace sixpoint::metrology
