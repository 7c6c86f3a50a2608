// What makes results uncertain beside the calibrations' own noise, from a machine's record and its studies, and as it is kept with a result
// (docs/methods/uncertainty.md, error sources).
#pragma once

#include <absl/status/statusor.h>
#include <google/protobuf/repeated_ptr_field.h>

#include <optional>
#include <string>
#include <vector>

#include "metrology/kinematics/angle_table.h"
#include "metrology/scanner/scanner_field.h"
#include "metrology/uncertainty/error_source.h"
#include "metrology/uncertainty/thermal_expansion.h"
#include "services/clients/calibrations.h"
#include "sixpoint/ingest/v1/scan.pb.h"
#include "sixpoint/plant/v1/machine.pb.h"
#include "sixpoint/plant/v1/part.pb.h"
#include "sixpoint/uncertainty/v1/uncertainty.pb.h"

namespace sixpoint::clients {

metrology::ScannerField FieldOf(const plant::v1::Sensor& sensor);
// How both rotary axes come to their poses.
metrology::Travel ApproachOf(const plant::v1::Machine& machine);

// Whether a source is what a blade's form did to its pose ("form, blades/SN-1").
bool IsFormOfBlade(const std::string& source);

// What a scan is of, and by what it is mapped.
struct Scanned {
  const plant::v1::Machine& machine;
  const plant::v1::Part& part;
  const ingest::v1::ScanHeader& scan;
};

// How much longer than at 20 C the part was on the machine's scales. Where the scan states no temperature it is taken as it is, as uncertain
// as the machine's record says. INVALID_ARGUMENT where a temperature is stated and what is needed with it is not.
absl::StatusOr<metrology::Stretch> StretchOf(const Scanned& scanned);

// arm: the machine's newest study; none: nobody studied it, and nothing is said of it. An arm that stands as it did when the sensor was
// calibrated has not moved. INVALID_ARGUMENT as StretchOf's, and where the encoder went the other way than it was calibrated.
absl::StatusOr<std::vector<metrology::ErrorSource>> FurtherSources(const Scanned& scanned,
                                                                   const FetchedSensorCalibration& sensor,
                                                                   const FetchedRotationCalibration& rotation,
                                                                   const std::optional<FetchedArmStudy>& arm);

void ToProto(const metrology::ErrorSource& source, uncertainty::v1::ErrorSource* out);
// INVALID_ARGUMENT naming the field where sizes are others or numbers not finite.
absl::StatusOr<std::vector<metrology::ErrorSource>> FromProto(
    const std::string& field, const google::protobuf::RepeatedPtrField<uncertainty::v1::ErrorSource>& in);

// The budgets of a result's values as they are kept: the names once, in the order in which they first come, and a standard uncertainty of
// each (um, six digits) for every value; 0 where it contributes nothing.
struct KeptBudgets {
  std::vector<std::string> sources;
  std::vector<std::vector<double>> standard_uncertainties_um;
};
KeptBudgets Kept(const std::vector<const std::vector<metrology::UncertaintyComponent>*>& components_um2);
// As it is answered, the greatest contribution first, without what contributes nothing. DATA_LOSS where there are not as many of both.
absl::StatusOr<std::vector<uncertainty::v1::UncertaintyComponent>> BudgetOf(const std::string& result,
                                                                            const std::vector<std::string>& sources,
                                                                            const std::vector<double>& um);

}  // namespace sixpoint::clients
