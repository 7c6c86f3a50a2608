// The options of `sixpoint register` that say how to fit, from text to message.
#pragma once

#include <absl/status/statusor.h>

#include <optional>
#include <string>
#include <vector>

#include "cli/command_line.h"
#include "sixpoint/registration/v1/registration.pb.h"

namespace sixpoint::cli {

struct RegisterOptions {
  std::vector<std::string> free, in, not_in;
  std::vector<double> weights;
  bool coarse = false;
  std::optional<double> least_stock_mm, greatest_stock_mm, patch_mm, least_side_part;
  std::optional<int> least_points;
  std::optional<double> held_turn_deg, held_shift_um;
};

// "turn-x", ...: what --free takes.
const std::vector<std::string>& RegisterFreedoms();
// "best-fit", "local", ...: what --method takes.
const std::vector<std::string>& RegisterMethods();
registration::v1::Method RegisterMethodOf(const std::string& text);

// The options added; the first are those that a blank has no part in.
std::vector<Option*> AddFitOptions(Command* command, RegisterOptions* options);
std::vector<Option*> AddRegisterOptions(Command* command, RegisterOptions* options);

// What maps the scans: --axis-tables, --sensor-calibration.
struct MappingOptions {
  Option *axis_tables, *sensor_calibration;
};
MappingOptions AddMappingOptions(Command* command, bool* axis_tables, std::string* sensor_calibration);

// Which scans of which blade, and how they are registered.
struct ScansToRegister {
  std::string blade, clamping, method, sensor_calibration;
  std::vector<std::string> scans;
  bool axis_tables = false;
  RegisterOptions options;
};
struct ScansToRegisterOptions {
  Option *blade, *scans, *method, *axis_tables;
  Option* clamping = nullptr;  // an inspection takes its scans'
  std::vector<Option*> how;
};
// An inspection registers its own scans, without an allowance: a machined part is no blank.
enum class RegisteredFor { kItself, kInspection };
ScansToRegisterOptions AddScansToRegister(Command* command, ScansToRegister* scans,
                                          RegisteredFor what = RegisteredFor::kItself);
// Without a request_id.
absl::StatusOr<registration::v1::RegisterRequest> RegisterRequestOf(const ScansToRegister& scans);

// Part frame, mm: "box:X,Y,Z:X,Y,Z" (two corners), "ball:X,Y,Z:RADIUS", "holes:GROUP:MARGIN". INVALID_ARGUMENT names the
// text and what was wanted.
absl::StatusOr<registration::v1::Region> RegionOf(const std::string& text);
absl::StatusOr<registration::v1::FitOptions> FitOptionsOf(const RegisterOptions& options);

}  // namespace sixpoint::cli
