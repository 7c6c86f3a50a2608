// A report of one blade, told from what its results' services gave: pure, so that the same record gives the same report.
#pragma once

#include <chrono>
#include <optional>
#include <string>
#include <vector>

#include "report/report.h"
#include "sixpoint/calibration/v1/calibration.pb.h"
#include "sixpoint/ingest/v1/scan.pb.h"
#include "sixpoint/inspection/v1/assessment.pb.h"
#include "sixpoint/inspection/v1/measurement.pb.h"
#include "sixpoint/plant/v1/machine.pb.h"
#include "sixpoint/plant/v1/part.pb.h"
#include "sixpoint/registration/v1/registration.pb.h"

namespace sixpoint::inspection {

struct ReportInputs {
  // Of each kind in the order asked.
  std::vector<v1::Inspection> inspections;
  std::vector<v1::DeviationMap> maps;
  std::vector<v1::SectionMeasurement> sections;
  std::vector<std::vector<v1::SectionOutline>> outlines;  // of each of `sections`, section by section
  // With it verdict and characteristics are its own, and not those that the results have by themselves.
  std::optional<v1::Assessment> assessment;
  plant::v1::Drawing drawing;  // that it names
  plant::v1::Part part;        // of the revision that all were measured against
  // All that the results rest on, each once.
  std::vector<registration::v1::Registration> registrations;
  std::vector<plant::v1::Machine> machines;
  std::vector<calibration::v1::Calibration> calibrations;
  std::vector<ingest::v1::Scan> scans;
  std::vector<v1::Measurement> measurements;       // of other instruments, that the assessment names
  std::vector<report::DeviationPicture> pictures;  // of the first maps
  std::string no_picture_reason;
};

// What every result says of itself.
struct ResultHead {
  std::string name, blade, registration, requested_by, software_version, computed_on, work_order, operation;
  registration::v1::Method method = registration::v1::METHOD_UNSPECIFIED;
  std::vector<std::string> scans;
  std::chrono::system_clock::time_point recorded_at;
};
ResultHead HeadOf(const v1::Inspection& inspection);
ResultHead HeadOf(const v1::DeviationMap& map);
ResultHead HeadOf(const v1::SectionMeasurement& measurement);
// Inspections, maps, sections.
std::vector<ResultHead> HeadsOf(const ReportInputs& inputs);

// What was not measured is unset, whatever was seen of it; what nobody judges has no verdict.
report::Report ReportOf(const ReportInputs& inputs);

// What the results rest on.
report::Traceability TraceabilityOf(const ReportInputs& inputs);

// Drawn start, measured start and verdict of each hole of each inspection.
std::vector<report::Hole> ReportedHolesOf(const ReportInputs& inputs);

}  // namespace sixpoint::inspection
