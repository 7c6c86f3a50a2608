#include "cli/register_options.h"

#include <absl/status/status.h>

#include <algorithm>
#include <cstdlib>
#include <sstream>

#include "cli/output.h"
#include "refusal/refusal.h"

namespace sixpoint::cli {
namespace {

using registration::v1::Region;

std::vector<std::string> Split(const std::string& text, char at) {
  std::vector<std::string> parts;
  std::istringstream in(text);
  for (std::string part; std::getline(in, part, at);) parts.push_back(part);
  return parts;
}

bool ReadNumber(const std::string& text, double* out) {
  char* end = nullptr;
  *out = std::strtod(text.c_str(), &end);
  return !text.empty() && *end == '\0';
}

bool ReadPoint(const std::string& text, geometry::v1::Point* out) {
  const std::vector<std::string> parts = Split(text, ',');
  double x = 0, y = 0, z = 0;
  if (parts.size() != 3 || !ReadNumber(parts[0], &x) || !ReadNumber(parts[1], &y) || !ReadNumber(parts[2], &z))
    return false;
  out->set_x_mm(x);
  out->set_y_mm(y);
  out->set_z_mm(z);
  return true;
}

void SetCorners(const geometry::v1::Point& one, const geometry::v1::Point& other, registration::v1::Box* box) {
  geometry::v1::Point &low = *box->mutable_minimum_mm(), &high = *box->mutable_maximum_mm();
  low.set_x_mm(std::min(one.x_mm(), other.x_mm()));
  low.set_y_mm(std::min(one.y_mm(), other.y_mm()));
  low.set_z_mm(std::min(one.z_mm(), other.z_mm()));
  high.set_x_mm(std::max(one.x_mm(), other.x_mm()));
  high.set_y_mm(std::max(one.y_mm(), other.y_mm()));
  high.set_z_mm(std::max(one.z_mm(), other.z_mm()));
}

}  // namespace

const std::vector<std::string>& RegisterFreedoms() {
  static const auto* freedoms =
      new std::vector<std::string>{"turn-x", "turn-y", "turn-z", "shift-x", "shift-y", "shift-z"};
  return *freedoms;
}

const std::vector<std::string>& RegisterMethods() {
  static const auto* methods =
      new std::vector<std::string>{"local", "six-point", "six-point-normals", "best-fit", "allowance"};
  return *methods;
}

registration::v1::Method RegisterMethodOf(const std::string& text) {
  using namespace registration::v1;
  return text == "local"               ? METHOD_LOCAL
         : text == "six-point"         ? METHOD_SIX_POINT
         : text == "six-point-normals" ? METHOD_SIX_POINT_NORMALS
         : text == "best-fit"          ? METHOD_BEST_FIT
         : text == "allowance"         ? METHOD_ALLOWANCE
                                       : METHOD_UNSPECIFIED;
}

std::vector<Option*> AddFitOptions(Command* command, RegisterOptions* options) {
  const auto list = [&](const char* name, std::vector<std::string>* values, const char* help) {
    return command->AddOption(name, values, help)->Repeat();
  };
  return {
      list("--free", &options->free, "Directions in which the part may move: turn-x,...,shift-z; without it all six")
          ->List()
          ->OneOf(RegisterFreedoms()),
      command->AddOption("--held-turn-deg", &options->held_turn_deg,
                         "Where turns are not free: standard uncertainty of each; unset, a program waits for a person"),
      command->AddOption("--held-shift-um", &options->held_shift_um, "The same of shifts"),
      list("--in", &options->in,
           "Where points count, part frame, mm: box:X,Y,Z:X,Y,Z, ball:X,Y,Z:RADIUS or holes:GROUP:MARGIN; repeatable"),
      list("--not-in", &options->not_in, "Where points do not count, as --in; repeatable"),
      command->AddOption("--weights", &options->weights, "Of each scan's points, in the order of --scans: W,W,...")
          ->List(),
      command->AddFlag("--coarse", &options->coarse, "Look for the part first, however far off and turned in any way")};
}

std::vector<Option*> AddRegisterOptions(Command* command, RegisterOptions* options) {
  std::vector<Option*> added = AddFitOptions(command, options);
  for (Option* of_allowance :
       {command->AddOption("--least-stock-mm", &options->least_stock_mm, "allowance: wanted everywhere; 0"),
        command->AddOption("--greatest-stock-mm", &options->greatest_stock_mm,
                           "allowance: points farther outside belong to something else; 5"),
        command->AddOption("--patch-mm", &options->patch_mm,
                           "allowance: stock is the mean over patches of this width; 1"),
        command->AddOption("--least-points", &options->least_points, "allowance: of a patch that counts; 5"),
        command->AddOption("--least-side-part", &options->least_side_part,
                           "allowance: of each side of the part, what must have been seen; 0.9")})
    added.push_back(of_allowance);
  return added;
}

MappingOptions AddMappingOptions(Command* command, bool* axis_tables, std::string* sensor_calibration) {
  return {command->AddFlag("--axis-tables", axis_tables,
                           "Take the scans where the axes' characterisations say they were; not where the control "
                           "compensates"),
          command->AddOption("--sensor-calibration", sensor_calibration,
                             "Maps the scans by it; without it by the one that was in force when they were received")};
}

ScansToRegisterOptions AddScansToRegister(Command* command, ScansToRegister* scans, RegisteredFor what) {
  const bool of_inspection = what == RegisteredFor::kInspection;
  std::vector<std::string> methods = RegisterMethods();
  if (of_inspection) methods.erase(std::remove(methods.begin(), methods.end(), "allowance"), methods.end());
  ScansToRegisterOptions added;
  added.blade = command->AddOption("--blade", &scans->blade, "Serial number");
  added.scans = command
                    ->AddOption("--scans", &scans->scans,
                                of_inspection ? "Scans with a pin in each hole: ID,ID,..." : "Its scans: ID,ID,...")
                    ->List();
  added.method = command
                     ->AddOption("--method", &scans->method,
                                 of_inspection ? "How the part is positioned: six-point (without it), "
                                                 "six-point-normals, best-fit or local"
                                               : "local, six-point, six-point-normals, best-fit or allowance")
                     ->OneOf(methods);
  added.axis_tables = AddMappingOptions(command, &scans->axis_tables, &scans->sensor_calibration).axis_tables;
  if (!of_inspection)
    added.clamping =
        command->AddOption("--clamping", &scans->clamping,
                           "As the machine calls it, another with every clamping; asked again at the program");
  added.how = of_inspection ? AddFitOptions(command, &scans->options) : AddRegisterOptions(command, &scans->options);
  return added;
}

absl::StatusOr<registration::v1::RegisterRequest> RegisterRequestOf(const ScansToRegister& scans) {
  registration::v1::RegisterRequest request;
  request.set_blade(NameText("blades", scans.blade));
  for (const std::string& scan : scans.scans) request.add_scans(NameText("scans", scan));
  request.set_method(RegisterMethodOf(scans.method));
  auto options = FitOptionsOf(scans.options);
  if (!options.ok()) return options.status();
  *request.mutable_options() = *std::move(options);
  request.set_apply_axis_tables(scans.axis_tables);
  request.set_clamping(scans.clamping);
  if (!scans.sensor_calibration.empty())
    request.set_sensor_calibration(NameText("calibrations", scans.sensor_calibration));
  return request;
}

absl::StatusOr<Region> RegionOf(const std::string& text) {
  const std::vector<std::string> parts = Split(text, ':');
  Region region;
  geometry::v1::Point one, other;
  double length = 0;
  if (parts.size() == 3 && parts[0] == "box" && ReadPoint(parts[1], &one) && ReadPoint(parts[2], &other)) {
    SetCorners(one, other, region.mutable_box());
    return region;
  }
  if (parts.size() == 3 && parts[0] == "ball" && ReadPoint(parts[1], &one) && ReadNumber(parts[2], &length)) {
    *region.mutable_ball()->mutable_centre_mm() = one;
    region.mutable_ball()->set_radius_mm(length);
    return region;
  }
  if (parts.size() == 3 && parts[0] == "holes" && !parts[1].empty() && ReadNumber(parts[2], &length)) {
    region.mutable_hole_group()->set_group(parts[1]);
    region.mutable_hole_group()->set_margin_mm(length);
    return region;
  }
  return Refuse("region", text, "box:X,Y,Z:X,Y,Z, ball:X,Y,Z:RADIUS or holes:GROUP:MARGIN, in mm");
}

absl::StatusOr<registration::v1::FitOptions> FitOptionsOf(const RegisterOptions& options) {
  registration::v1::FitOptions out;
  const std::vector<std::string>& freedoms = RegisterFreedoms();
  for (const std::string& freedom : options.free)
    out.add_degrees_of_freedom(static_cast<registration::v1::Freedom>(
        registration::v1::FREEDOM_TURN_X + (std::find(freedoms.begin(), freedoms.end(), freedom) - freedoms.begin())));
  if (options.held_turn_deg) out.set_held_turn_standard_uncertainty_deg(*options.held_turn_deg);
  if (options.held_shift_um) out.set_held_shift_standard_uncertainty_um(*options.held_shift_um);
  out.mutable_scan_weights()->Add(options.weights.begin(), options.weights.end());
  for (const auto& [texts, regions] :
       {std::pair(&options.in, out.mutable_regions_in()), std::pair(&options.not_in, out.mutable_regions_out())})
    for (const std::string& text : *texts) {
      auto region = RegionOf(text);
      if (!region.ok()) return region.status();
      *regions->Add() = *std::move(region);
    }
  out.set_coarse_start(options.coarse);
  if (options.least_stock_mm) out.mutable_allowance()->set_least_stock_mm(*options.least_stock_mm);
  if (options.greatest_stock_mm) out.mutable_allowance()->set_greatest_stock_mm(*options.greatest_stock_mm);
  if (options.patch_mm) out.mutable_allowance()->set_patch_mm(*options.patch_mm);
  if (options.least_points) out.mutable_allowance()->set_least_points(*options.least_points);
  if (options.least_side_part) out.mutable_allowance()->set_least_side_part(*options.least_side_part);
  return out;
}

}  // namespace sixpoint::cli
