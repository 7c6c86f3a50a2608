// Measurements of other instruments as messages, and what an import states.
#pragma once

#include <absl/status/statusor.h>

#include "exchange/measured_file.h"
#include "services/inspection/measured_values.h"
#include "sixpoint/inspection/v1/measurement.pb.h"
#include "storage/measurements.h"

namespace sixpoint::inspection {

absl::StatusOr<v1::Measurement> ToProto(const storage::MeasurementRow& row);
// All that an import recorded, without the values.
absl::StatusOr<v1::ImportMeasurementsResponse> ToProto(const storage::MeasurementImport& import);

// What the basic view leaves.
void LeaveBasic(v1::Measurement* measurement);

// What is said of the file as a whole, checked; the drawing is not asked yet.
struct ImportOrder {
  exchange::MeasuredFormat format = exchange::MeasuredFormat::kCsv;
  FileStatement statement;
  storage::MeasuredFileRow file;  // but for the drawing, and who asked
};
absl::StatusOr<ImportOrder> OrderOf(const v1::ImportMeasurementsRequest& request);

}  // namespace sixpoint::inspection
