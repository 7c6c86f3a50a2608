// Results as people read them.
#pragma once

#include <string>

#include "cli/table.h"
#include "sixpoint/calibration/v1/calibration.pb.h"
#include "sixpoint/correction/v1/correction.pb.h"
#include "sixpoint/inspection/v1/inspection.pb.h"
#include "sixpoint/plant/v1/drawing.pb.h"
#include "sixpoint/registration/v1/registration.pb.h"

namespace sixpoint::cli {

// "sensor", "axis A" and so on.
std::string CalibrationKindText(const calibration::v1::Calibration& calibration);
// Its name and state, then every parameter beside its standard uncertainty, then the checks.
std::string CalibrationText(const calibration::v1::Calibration& calibration);

// The evidence behind a pose, one row for each registration.
Table RegistrationTable();
void AddRegistrationRow(const std::string& blade, const std::string& method,
                        const registration::v1::Registration& registration, Table* table);
std::string RegistrationText(const registration::v1::Registration& registration);

// As Table 10 of the thesis, for every hole: nominal beside corrected, with the expanded uncertainty (95 %).
// `first` heads the column of AddCorrectionRows' first argument.
Table CorrectionTable(const std::string& first, const std::string& bed = "A", const std::string& carried = "B");
void AddCorrectionRows(const std::string& label, const correction::v1::Correction& correction, Table* table);
std::string CorrectionText(const correction::v1::Correction& correction);

// Each hole's errors beside their tolerance and expanded uncertainty, with the verdict.
Table InspectionTable();
void AddInspectionRows(const inspection::v1::Inspection& inspection, Table* table);
std::string InspectionText(const inspection::v1::Inspection& inspection);

// "six-point", "CONFORM" and so on: the enums' names without their prefixes.
std::string MethodText(registration::v1::Method method);
std::string OutcomeName(registration::v1::Outcome outcome);
std::string VerdictName(inspection::v1::Verdict verdict);
// "ISO 14253-1:2017", "GUARD_FACTOR 0.5".
std::string RuleText(const plant::v1::DecisionRule& rule);

}  // namespace sixpoint::cli
