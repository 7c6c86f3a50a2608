#include <algorithm>
#include <utility>
#include <vector>

#include "exchange/qif.h"
#include "exchange/qif_elements.h"
#include "exchange/qif_points.h"
#include "exchange/qif_words.h"
#include "exchange/text.h"
#include "exchange/verdicts.h"
#include "exchange/xml_writer.h"
#include "refusal/refusal.h"

namespace sixpoint::exchange {
namespace {

using Kind = Characteristic::Kind;
using qif::Count;
using qif::Id;
using qif::Ids;
using qif::Named;
using qif::Text;
using qif::WriteAttributes;

// Without a length's or an angle's unit: its limits stand with its nominal, and each number names the unit.
constexpr std::string_view kRatioElement = "UserDefinedUnit";

// What element a characteristic is. A zone about nominal can be told of by position and profile alone; with other limits, or none, they are
// a length that a text explains.
std::string_view ElementOf(const Characteristic& c) {
  if (c.kind == Kind::kInclination || c.kind == Kind::kAngle) return "UserDefinedAngular";
  if (c.kind == Kind::kLength) return "UserDefinedLinear";
  if (c.kind == Kind::kRatio) return kRatioElement;
  const bool about_nominal = c.nominal == 0 && c.upper && *c.upper >= 0;
  const double least = c.kind == Kind::kPosition ? 0 : -c.upper.value_or(0);
  if (!about_nominal || (c.lower && *c.lower != least)) return "UserDefinedLinear";
  return c.kind == Kind::kPosition ? "Position" : "SurfaceProfile";
}
bool IsZone(std::string_view element) { return element == "Position" || element == "SurfaceProfile"; }

std::string WhatToMeasure(Kind kind) {
  switch (kind) {
    case Kind::kPosition:
      return "distance of the hole's start from its nominal start";
    case Kind::kInclination:
      return "angle of the hole's axis with its nominal axis";
    case Kind::kProfile:
      return "greatest distance of the surface from nominal";
    default:
      return "as the drawing's characteristic of this number says";
  }
}

void WriteUnit(XmlWriter& xml, std::string_view element, std::string_view si, std::string_view name,
               std::string_view factor) {
  xml.Open(element).Element("SIUnitName", si).Element("UnitName", name);
  xml.Open("UnitConversion").Element("Factor", factor).Close().Close();
}

void WriteUnits(XmlWriter& xml, const InspectedPart& part) {
  xml.Open("FileUnits").Open("PrimaryUnits");
  WriteUnit(xml, "AngularUnit", "radian", "degree", "0.017453292519943295");
  WriteUnit(xml, "LinearUnit", "meter", "mm", "0.001");
  xml.Close();
  const auto is_ratio = [](const Characteristic& c) { return c.kind == Kind::kRatio; };
  if (std::any_of(part.characteristics.begin(), part.characteristics.end(), is_ratio)) {
    xml.Open("UserDefinedUnits", Count(1)).Open("UserDefinedUnit");
    xml.Element("WhatIsMeasured", "ratio of two lengths").Element("UnitName", qif::kRatioUnit).Close().Close();
  }
  xml.Close();
}

void WriteStandard(XmlWriter& xml) {
  xml.Open("StandardsDefinitions", Count(1)).Open("Standard", Id(Ids::kStandard));
  xml.Open("Organization").Element("StandardsOrganizationEnum", "ISO").Close();
  xml.Element("Designator", "1101").Close().Close();
}

void WriteProduct(XmlWriter& xml, const InspectedPart& part) {
  xml.Open("Product").Open("PartSet", Count(1)).Open("Part", Id(Ids::kPart));
  xml.Element("ModelNumber", part.part).Element("Version", std::to_string(part.part_revision));
  xml.Close().Close().Close();
}

void WriteTolerance(XmlWriter& xml, const Characteristic& c) {
  if (!c.lower && !c.upper) {
    xml.Element("NonTolerance", "MEASURED");
    return;
  }
  xml.Open("Tolerance");
  if (c.upper) xml.Element("MaxValue", DecimalText(*c.upper));
  if (c.lower) xml.Element("MinValue", DecimalText(*c.lower));
  xml.Element("DefinedAsLimit", "true").Close();
}

void WriteDefinition(XmlWriter& xml, const Characteristic& c, std::size_t i) {
  const std::string_view element = ElementOf(c);
  xml.Open(std::string(element) + "CharacteristicDefinition", Id(Ids::Definition(i)));
  Named ours;
  if (element == "UserDefinedLinear" || c.kind == Kind::kAngle || c.kind == Kind::kRatio)
    ours.emplace_back(qif::kKind, KindName(c.kind));
  if (IsZone(element) && c.lower) ours.emplace_back(qif::kLower, DecimalText(*c.lower));
  WriteAttributes(xml, ours);
  if (IsZone(element)) {
    xml.Element("ToleranceValue", DecimalText(2 * *c.upper));
    if (element == "Position")
      xml.Element("MaterialCondition", "NONE").Open("ZoneShape").Empty("DiametricalZone").Close();
  } else if (element != kRatioElement) {
    WriteTolerance(xml, c);
    xml.Element("WhatToMeasure", WhatToMeasure(c.kind));
  }
  xml.Close();
}

void WriteRatioNominal(XmlWriter& xml, const Characteristic& c) {
  const XmlWriter::Attributes unit = {{"unitName", qif::kRatioUnit}};
  xml.Element("TargetValue", DecimalText(c.nominal), unit);
  if (c.upper) xml.Element("MaxValue", DecimalText(*c.upper), unit);
  if (c.lower) xml.Element("MinValue", DecimalText(*c.lower), unit);
  xml.Element("DefinedAsLimit", "true");
}

void WriteNominal(XmlWriter& xml, const Characteristic& c, std::size_t i) {
  const std::string_view element = ElementOf(c);
  xml.Open(std::string(element) + "CharacteristicNominal", Id(Ids::Nominal(i)));
  xml.Element("CharacteristicDefinitionId", Text(Ids::Definition(i)));
  if (element == kRatioElement)
    WriteRatioNominal(xml, c);
  else if (!IsZone(element))
    xml.Element("TargetValue", DecimalText(c.nominal));
  xml.Close();
}

void WriteItem(XmlWriter& xml, const InspectedPart& part, std::size_t i) {
  const Characteristic& c = part.characteristics[i];
  xml.Open(std::string(ElementOf(c)) + "CharacteristicItem", Id(Ids::Item(i)));
  xml.Element("Name", c.name).Open("CharacteristicDesignator").Element("Designator", c.name);
  xml.Element("UUID", QifCharacteristicId(part.part, part.part_revision, c.name)).Close();
  xml.Element("CharacteristicNominalId", Text(Ids::Nominal(i))).Close();
}

void WriteCharacteristics(XmlWriter& xml, const InspectedPart& part) {
  const std::size_t count = part.characteristics.size();
  xml.Open("Characteristics").Element("FormalStandardId", Text(Ids::kStandard));
  xml.Open("CharacteristicDefinitions", Count(count));
  for (std::size_t i = 0; i < count; ++i) WriteDefinition(xml, part.characteristics[i], i);
  xml.Close().Open("CharacteristicNominals", Count(count));
  for (std::size_t i = 0; i < count; ++i) WriteNominal(xml, part.characteristics[i], i);
  xml.Close().Open("CharacteristicItems", Count(count));
  for (std::size_t i = 0; i < count; ++i) WriteItem(xml, part, i);
  xml.Close().Close();
}

void WriteResources(XmlWriter& xml, const InspectedPart& part, const Ids& ids) {
  xml.Open("MeasurementResources").Open("MeasurementDevices", Count(1)).Open("MeasurementDevice", Id(ids.device()));
  xml.Element("Name", "machine tool with a line scanner").Element("Description", part.machine).Close().Close();
  if (!part.sensor_model.empty() || !part.sensor_serial_number.empty()) {
    xml.Open("Tools", Count(1))
        .Open("ToolWithLaserTriangulationSensor", Id(ids.tool()))
        .Element("Name", "line scanner");
    xml.Open("LaserTriangulationSensor", Id(ids.sensor())).Element("Name", "laser triangulation sensor");
    xml.ElementUnlessEmpty("ModelNumber", part.sensor_model)
        .ElementUnlessEmpty("SerialNumber", part.sensor_serial_number);
    xml.Close().Close().Close();
  }
  xml.Close();
}

void WriteTraceability(XmlWriter& xml, const InspectedPart& part, const std::string& plan, const Ids& ids) {
  xml.Open("InspectionTraceability").ElementUnlessEmpty("OrderNumber", part.work_order);
  xml.Open("InspectionSoftwareItems").Open("AnalysisSoftware", Count(1)).Element("Id", Text(ids.software()));
  xml.Close().Close();
  if (!part.requested_by.empty()) xml.Open("InspectionOperator").Element("Name", part.requested_by).Close();
  xml.Open("ReferencedQIFPlanInstance").Element("ItemQPId", plan).Element("DocumentQPId", plan).Close();
  Named ours = {{qif::kResult, part.result},
                {qif::kMachine, part.machine},
                {qif::kMachineRevision, std::to_string(part.machine_revision)},
                {qif::kOperation, part.operation},
                {qif::kDecisionRule, part.decision_rule},
                {qif::kMethod, part.method},
                {qif::kRegistration, part.registration},
                {qif::kUncertainty,
                 "combinedUncertainty is a standard uncertainty u; expanded, 95 %: 2 u; no mean error is known"}};
  for (const std::string& calibration : part.calibrations) ours.emplace_back(qif::kCalibration, calibration);
  for (const std::string& scan : part.scans) ours.emplace_back(qif::kScan, scan);
  WriteAttributes(xml, ours);
  xml.Close();
}

void WriteValue(XmlWriter& xml, std::string_view element, const MeasuredValue& v) {
  const double scale = IsZone(element) ? 2 : 1;
  XmlWriter::Attributes attributes;
  if (v.expanded_uncertainty)
    attributes = {{"combinedUncertainty", DecimalText(scale * *v.expanded_uncertainty / 2)}, {"meanError", "0"}};
  if (element == kRatioElement) attributes.emplace_back("unitName", qif::kRatioUnit);
  xml.Element("Value", DecimalText(scale * *v.value), attributes);
  if (element != "SurfaceProfile") return;
  if (v.worst_positive) xml.Element("WorstPositiveDeviation", DecimalText(*v.worst_positive));
  if (v.worst_negative) xml.Element("WorstNegativeDeviation", DecimalText(*v.worst_negative));
}

void WriteMeasurement(XmlWriter& xml, const InspectedPart& part, const Ids& ids, const std::string& time,
                      std::size_t i) {
  const std::string_view element = ElementOf(part.characteristics[i]);
  const MeasuredValue& v = part.values[i];
  xml.Open(std::string(element) + "CharacteristicMeasurement", Id(ids.Measurement(i)));
  Named ours;
  if (element == "UserDefinedLinear") {
    if (v.worst_negative) ours.emplace_back(qif::kWorstNegative, DecimalText(*v.worst_negative));
    if (v.worst_positive) ours.emplace_back(qif::kWorstPositive, DecimalText(*v.worst_positive));
  }
  WriteAttributes(xml, ours);
  xml.ElementUnlessEmpty("Description", v.reason);
  xml.Open("Status").Element("CharacteristicStatusEnum", QifStatus(v.verdict)).Close();
  xml.Element("CharacteristicItemId", Text(Ids::Item(i))).Element("TimeStamp", time);
  xml.Element("ActualComponentId", Text(ids.component()));
  xml.Open("MeasurementDeviceIds", Count(1)).Element("Id", Text(ids.device())).Close();
  if (v.value) WriteValue(xml, element, v);
  if (element == "SurfaceProfile" && !v.points.empty()) qif::WritePointDeviations(xml, v.points, ids.PointSet(i));
  xml.Close();
}

void WriteInspectionStatus(XmlWriter& xml, std::string_view element, Verdict verdict) {
  xml.Open(element).Element("InspectionStatusEnum", QifInspectionStatus(verdict)).Close();
}

void WriteResults(XmlWriter& xml, const InspectedPart& part, const std::string& plan, const Ids& ids) {
  xml.Open("Results").Open("MeasurementResultsSet", Count(1)).Open("MeasurementResults", Id(ids.results()));
  WriteTraceability(xml, part, plan, ids);
  xml.Element("ThisResultsInstanceQPId", *UuidOf(part.result));
  qif::WritePointSets(xml, part, ids);
  xml.Open("MeasuredCharacteristics").Open("CharacteristicMeasurements", Count(part.values.size()));
  const std::string time = TimeText(part.recorded_at);
  for (std::size_t i = 0; i < part.values.size(); ++i) WriteMeasurement(xml, part, ids, time, i);
  xml.Close().Close();
  WriteInspectionStatus(xml, "InspectionStatus", part.verdict);
  xml.Open("ActualComponentIds", Count(1)).Element("Id", Text(ids.component())).Close().Close().Close();
  xml.Open("ActualComponentSets", Count(1)).Open("ActualComponentSet", Count(1));
  xml.Open("ActualComponent", Id(ids.component())).Element("SerialNumber", part.serial);
  WriteInspectionStatus(xml, "Status", part.verdict);
  xml.Close().Close().Close().Close();
}

void OpenDocument(XmlWriter& xml, std::size_t last_id, const std::string& qp_id) {
  xml.Open("QIFDocument", {{"xmlns", "http://qifstandards.org/xsd/qif3"},
                           {"xmlns:xsi", "http://www.w3.org/2001/XMLSchema-instance"},
                           {"xsi:schemaLocation", "http://qifstandards.org/xsd/qif3 QIFDocument.xsd"},
                           {"versionQIF", "3.0.0"},
                           {"idMax", Text(last_id)}});
  xml.Element("QPId", qp_id);
}

absl::Status CheckForQif(const InspectedPart& part) {
  if (const absl::Status status = Check(part); !status.ok()) return status;
  if (part.characteristics.empty()) return Refuse("characteristics", "", "one or more");
  for (std::size_t i = 0; i < part.characteristics.size(); ++i)
    if (part.characteristics[i].kind == Kind::kOther)
      return Refuse("characteristics[" + Text(i) + "].kind", "other", "what Sixpoint measures");
    else if (const Characteristic& c = part.characteristics[i]; c.kind == Kind::kRatio && !c.lower && !c.upper)
      return Refuse("characteristics[" + Text(i) + "].upper", "", "a limit, of a ratio");
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<QifPlan> QifPlan::Of(const InspectedPart& part) {
  if (const absl::Status status = CheckForQif(part); !status.ok()) return status;
  QifPlan plan;
  plan.of_.part = part.part;
  plan.of_.part_revision = part.part_revision;
  plan.of_.characteristics = part.characteristics;
  plan.id_ = QifPlanId(part);
  XmlWriter xml;
  OpenDocument(xml, 0, plan.id_);
  const std::size_t before = xml.written().size();
  WriteCharacteristics(xml, part);
  plan.characteristics_ = xml.written().substr(before);
  return plan;
}

std::string QifPlan::PlanDocument() const {
  XmlWriter xml;
  OpenDocument(xml, Ids{of_.characteristics.size()}.last_of_plan(), id_);
  WriteStandard(xml);
  WriteUnits(xml, of_);
  WriteProduct(xml, of_);
  xml.Written(characteristics_);
  xml.Open("Plan").Open("UnorderedPlanRoot").Open("Steps", Count(1)).Empty("MeasureEvaluateAll");
  xml.Close().Close().Close().Close();
  return xml.Take();
}

absl::StatusOr<std::string> QifPlan::ResultDocument(const InspectedPart& part) const {
  if (const absl::Status status = CheckForQif(part); !status.ok()) return status;
  if (!IsOf(part)) return Refuse("characteristics", part.part, "those of the plan " + id_);
  if (!UuidOf(part.result))
    return Refuse("result", part.result, "inspections/UUID, deviations/UUID or assessments/UUID");
  const Ids ids{part.characteristics.size(), qif::WithPoints(part)};
  XmlWriter xml;
  OpenDocument(xml, ids.last(), QifDocumentId(part.result));
  xml.Open("Version").Element("TimeCreated", TimeText(part.recorded_at)).Close();
  xml.Open("Header").Open("Application").Element("Name", "Sixpoint").Close().Close();
  xml.Open("ExternalQIFReferences", Count(1)).Open("ExternalQIFDocument", Id(ids.plan()));
  xml.Element("QPId", id_);
  xml.Element("Description", "the plan: this part's characteristics, under the same ids and UUIDs as here")
      .Close()
      .Close();
  WriteStandard(xml);
  xml.Open("SoftwareDefinitions", Count(1)).Open("Software", Id(ids.software()));
  xml.Element("VendorName", "Sixpoint").Element("ApplicationName", "Sixpoint");
  xml.ElementUnlessEmpty("Version", part.software_version).Close().Close();
  WriteUnits(xml, part);
  WriteResources(xml, part, ids);
  WriteProduct(xml, part);
  xml.Written(characteristics_);
  WriteResults(xml, part, id_, ids);
  xml.Close();
  return xml.Take();
}

absl::StatusOr<std::string> QifPlanOf(const InspectedPart& part) {
  const auto plan = QifPlan::Of(part);
  if (!plan.ok()) return plan.status();
  return plan->PlanDocument();
}

absl::StatusOr<std::string> ToQif(const InspectedPart& part) {
  const auto plan = QifPlan::Of(part);
  if (!plan.ok()) return plan.status();
  return plan->ResultDocument(part);
}

}  // namespace sixpoint::exchange
