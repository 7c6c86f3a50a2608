#include <array>
#include <cmath>
#include <map>
#include <pugixml.hpp>
#include <set>

#include "exchange/qif.h"
#include "exchange/qif_words.h"
#include "exchange/text.h"
#include "exchange/verdicts.h"
#include "refusal/refusal.h"

namespace sixpoint::exchange {
namespace {

using Kind = Characteristic::Kind;

// What parsing may take: a node has some 60 bytes, an attribute 40.
constexpr std::size_t kMostTags = 1500000, kMostQuotes = 4000000;
constexpr int kDeepest = 64;
constexpr std::string_view kMeasurement = "CharacteristicMeasurement";
constexpr double kDegreesInRadian = 57.295779513082323;

std::string TextAt(pugi::xml_node node, const char* child) { return node.child(child).text().get(); }
std::string TrimmedAt(pugi::xml_node node, const char* child) { return std::string(Trimmed(TextAt(node, child))); }

// Of the node's own Attributes; empty where there is none.
std::string Ours(pugi::xml_node node, std::string_view name) {
  for (const pugi::xml_node attribute : node.child("Attributes").children("AttributeStr"))
    if (attribute.attribute("name").value() == name) return attribute.attribute("value").value();
  return "";
}

absl::StatusOr<std::optional<double>> OptionalNumber(const std::string& field, const std::string& text) {
  if (Trimmed(text).empty()) return std::optional<double>();
  const auto number = NumberOf(text);
  if (!number) return Refuse(field, text, "a number");
  return number;
}

absl::Status CheckBytes(std::string_view document) {
  if (document.size() > kMostQifBytes)
    return Refuse("document", std::to_string(document.size()) + " bytes", "at most " + std::to_string(kMostQifBytes));
  std::size_t tags = 0, quotes = 0;
  for (const char c : document) {
    tags += c == '<';
    quotes += c == '"' || c == '\'';
  }
  if (tags > kMostTags)
    return Refuse("document", std::to_string(tags) + " tags", "at most " + std::to_string(kMostTags));
  if (quotes > kMostQuotes)
    return Refuse("document", std::to_string(quotes) + " quotes", "at most " + std::to_string(kMostQuotes));
  // No entities, so none that grow.
  if (document.find("<!DOCTYPE") != std::string_view::npos) return Refuse("document", "<!DOCTYPE", "no document type");
  return absl::OkStatus();
}

absl::Status CheckDepth(const pugi::xml_document& document) {
  int depth = 0;
  for (pugi::xml_node node = document.first_child(); node;) {
    if (node.first_child()) {
      node = node.first_child();
      if (++depth > kDeepest)
        return Refuse("document", "deeper", "at most " + std::to_string(kDeepest) + " elements deep");
      continue;
    }
    while (node && !node.next_sibling()) {
      node = node.parent();
      --depth;
    }
    if (node) node = node.next_sibling();
  }
  return absl::OkStatus();
}

// How many mm or degrees one unit of the file is.
struct Unit {
  std::optional<double> scale;
  std::string name;
};

absl::StatusOr<Unit> ReadUnit(pugi::xml_node units, const char* element, double si_scale,
                              const std::map<std::string, double>& known) {
  const pugi::xml_node node = units.child(element);
  Unit unit;
  if (!node) return unit;
  unit.name = TrimmedAt(node, "UnitName");
  const std::string factor = TextAt(node.child("UnitConversion"), "Factor");
  const auto offset = NumberOf(TextAt(node.child("UnitConversion"), "Offset"));
  if (offset.value_or(0) != 0) return Refuse(std::string(element) + ".Offset", *offset, "0");
  const auto named = known.find(unit.name);
  if (factor.empty() && named == known.end()) return Refuse(element, unit.name, "a unit with a factor");
  if (factor.empty()) {
    unit.scale = named->second;
    return unit;
  }
  const auto si = NumberOf(factor);
  if (!si || !(*si > 0)) return Refuse(std::string(element) + ".Factor", factor, "a number > 0");
  unit.scale = *si * si_scale;
  // A factor with a few digits of pi less is meant as the degree.
  if (std::abs(*unit.scale - 1) < 1e-9) unit.scale = 1;
  return unit;
}

class QifReader {
 public:
  explicit QifReader(pugi::xml_node root) : root_(root) {}

  absl::StatusOr<InspectedPart> Read() {
    for (const auto step : {&QifReader::ReadUnits, &QifReader::FindResults, &QifReader::Index,
                            &QifReader::ReadTraceability, &QifReader::ReadComponent, &QifReader::ReadMeasurements})
      if (const absl::Status status = (this->*step)(); !status.ok()) return status;
    const auto told =
        VerdictOfQifInspectionStatus(TrimmedAt(results_.child("InspectionStatus"), "InspectionStatusEnum"));
    part_.verdict = told.value_or(Verdict::kUndecidable);
    if (const absl::Status status = Check(part_); !status.ok()) return status;
    return std::move(part_);
  }

 private:
  using Nodes = std::map<std::string, pugi::xml_node>;
  enum Aspect { kDefinitions, kNominals, kItems };

  absl::Status ReadUnits() {
    const pugi::xml_node units = root_.child("FileUnits").child("PrimaryUnits");
    auto linear =
        ReadUnit(units, "LinearUnit", 1000,
                 {{"mm", 1}, {"millimeter", 1}, {"millimetre", 1}, {"m", 1000}, {"meter", 1000}, {"inch", 25.4}});
    if (!linear.ok()) return linear.status();
    auto angular = ReadUnit(units, "AngularUnit", kDegreesInRadian,
                            {{"degree", 1}, {"deg", 1}, {"radian", kDegreesInRadian}, {"rad", kDegreesInRadian}});
    if (!angular.ok()) return angular.status();
    linear_ = *std::move(linear);
    angular_ = *std::move(angular);
    return absl::OkStatus();
  }

  absl::Status FindResults() {
    const pugi::xml_node set = root_.child("Results").child("MeasurementResultsSet");
    std::size_t count = 0;
    for (const pugi::xml_node node : set.children("MeasurementResults")) {
      results_ = node;
      ++count;
    }
    if (count != 1)
      return Refuse("Results.MeasurementResultsSet", std::to_string(count) + " results", "the results of one part");
    return CheckCount(set, "MeasurementResultsSet");
  }

  // What a list says of its length is what it holds.
  absl::Status CheckCount(pugi::xml_node list, const std::string& field) {
    if (!list.attribute("n")) return absl::OkStatus();
    std::size_t count = 0;
    for (const pugi::xml_node child : list.children()) count += child.type() == pugi::node_element;
    const std::string said = list.attribute("n").value();
    return std::string(Trimmed(said)) == std::to_string(count) ? absl::OkStatus()
                                                               : Refuse(field + ".n", said, std::to_string(count));
  }

  absl::Status Index() {
    const pugi::xml_node all = root_.child("Characteristics");
    const char* lists[] = {"CharacteristicDefinitions", "CharacteristicNominals", "CharacteristicItems"};
    for (int aspect = kDefinitions; aspect <= kItems; ++aspect) {
      for (const pugi::xml_node node : all.child(lists[aspect]).children()) {
        if (node.type() != pugi::node_element) continue;
        const std::string id = node.attribute("id").value();
        if (!nodes_[aspect].emplace(id, node).second)
          return Refuse(std::string(lists[aspect]) + ".id", id, "each id once");
      }
      if (nodes_[aspect].size() > kMostQifCharacteristics)
        return Refuse(lists[aspect], std::to_string(nodes_[aspect].size()),
                      "at most " + std::to_string(kMostQifCharacteristics));
    }
    return absl::OkStatus();
  }

  absl::Status ReadTraceability() {
    const pugi::xml_node trace = results_.child("InspectionTraceability");
    part_.result = Ours(trace, qif::kResult);
    part_.machine = Ours(trace, qif::kMachine);
    part_.machine_revision = WholeNumberOf(Ours(trace, qif::kMachineRevision)).value_or(0);
    part_.operation = Ours(trace, qif::kOperation);
    part_.decision_rule = Ours(trace, qif::kDecisionRule);
    part_.method = Ours(trace, qif::kMethod);
    part_.registration = Ours(trace, qif::kRegistration);
    for (const pugi::xml_node attribute : trace.child("Attributes").children("AttributeStr")) {
      const std::string_view name = attribute.attribute("name").value();
      if (name == qif::kCalibration) part_.calibrations.emplace_back(attribute.attribute("value").value());
      if (name == qif::kScan) part_.scans.emplace_back(attribute.attribute("value").value());
    }
    part_.work_order = TextAt(trace, "OrderNumber");
    part_.requested_by = TextAt(trace.child("InspectionOperator"), "Name");
    part_.software_version = TextAt(root_.child("SoftwareDefinitions").child("Software"), "Version");
    const pugi::xml_node sensor = root_.child("MeasurementResources")
                                      .child("Tools")
                                      .child("ToolWithLaserTriangulationSensor")
                                      .child("LaserTriangulationSensor");
    part_.sensor_model = TextAt(sensor, "ModelNumber");
    part_.sensor_serial_number = TextAt(sensor, "SerialNumber");
    const pugi::xml_node product = root_.child("Product").child("PartSet").child("Part");
    part_.part = TextAt(product, "ModelNumber");
    if (part_.part.empty()) part_.part = product.attribute("label").value();
    part_.part_revision = WholeNumberOf(TextAt(product, "Version")).value_or(0);
    for (const std::string& text : {TextAt(root_.child("Version"), "TimeCreated"), TextAt(trace, "InspectionEnd")})
      if (const auto time = TimeOf(text)) part_.recorded_at = *time;
    return absl::OkStatus();
  }

  absl::Status ReadComponent() {
    const std::string id = TrimmedAt(results_.child("ActualComponentIds"), "Id");
    for (const pugi::xml_node set : root_.child("Results").child("ActualComponentSets").children("ActualComponentSet"))
      for (const pugi::xml_node component : set.children("ActualComponent"))
        if (id.empty() || id == component.attribute("id").value()) {
          part_.serial = TextAt(component, "SerialNumber");
          return absl::OkStatus();
        }
    return id.empty() ? absl::OkStatus() : Refuse("ActualComponentIds", id, "a component of this document");
  }

  absl::Status ReadMeasurements() {
    const pugi::xml_node list = results_.child("MeasuredCharacteristics").child("CharacteristicMeasurements");
    if (const absl::Status status = CheckCount(list, "CharacteristicMeasurements"); !status.ok()) return status;
    for (const pugi::xml_node node : list.children()) {
      if (node.type() != pugi::node_element) continue;
      if (part_.values.size() >= kMostQifCharacteristics)
        return Refuse("CharacteristicMeasurements", "more", "at most " + std::to_string(kMostQifCharacteristics));
      const pugi::xml_node item = node.child("CharacteristicItemId");
      const std::string id(Trimmed(item.text().get()));
      if (item.attribute("xId"))
        return Refuse("CharacteristicItemId", id + " of another document", "one of this document");
      if (const absl::Status status = ReadMeasurement(node, id); !status.ok())
        return Under(std::string(node.name()) + "[" + node.attribute("id").value() + "].", status);
    }
    return absl::OkStatus();
  }

  absl::Status ReadMeasurement(pugi::xml_node node, const std::string& item_id) {
    const std::string_view name = node.name();
    if (name.size() <= kMeasurement.size() || name.substr(name.size() - kMeasurement.size()) != kMeasurement)
      return Refuse("name", std::string(name), "a measurement of a characteristic");
    const std::string element(name.substr(0, name.size() - kMeasurement.size()));
    const bool angular =
        element.rfind("Angle", 0) == 0 || element == "AngularCoordinate" || element == "UserDefinedAngular";
    for (const char* other : {"Mass", "Force", "Pressure", "Temperature", "Time", "Speed", "Area",
                              "UserDefinedAttribute", "SurfaceTexture", "Curvature"})
      if (element == other) return Refuse("name", element, "a length or an angle");
    // Of ours alone: what another means by a unit of its own is not known.
    static const Unit kNone{1.0, qif::kRatioUnit};
    const bool ratio = element == "UserDefinedUnit";
    if (ratio && std::string(node.child("Value").attribute("unitName").value()) != qif::kRatioUnit &&
        node.child("Value"))
      return Refuse("Value.unitName", node.child("Value").attribute("unitName").value(), qif::kRatioUnit);
    const Unit& unit = ratio ? kNone : angular ? angular_ : linear_;
    if (!unit.scale)
      return Refuse(angular ? "FileUnits.AngularUnit" : "FileUnits.LinearUnit", "", "the unit of the file's values");
    Characteristic c;
    c.unit = ratio ? "1" : angular ? "deg" : "mm";
    const bool zone = element == "Position" || element == "SurfaceProfile";
    c.kind = element == "Position"             ? Kind::kPosition
             : element == "SurfaceProfile"     ? Kind::kProfile
             : element == "UserDefinedAngular" ? Kind::kInclination
             : ratio                           ? Kind::kRatio
                                               : Kind::kOther;
    if (const absl::Status status = ReadCharacteristic(item_id, *unit.scale, zone, &c); !status.ok()) return status;
    MeasuredValue value;
    if (const absl::Status status = ReadValue(node, unit, zone, &value); !status.ok()) return status;
    if (c.kind != Kind::kProfile) value.worst_negative = value.worst_positive = std::nullopt;
    part_.characteristics.push_back(std::move(c));
    part_.values.push_back(std::move(value));
    return absl::OkStatus();
  }

  pugi::xml_node Find(Aspect aspect, const std::string& id) const {
    const auto found = nodes_[aspect].find(id);
    return found == nodes_[aspect].end() ? pugi::xml_node() : found->second;
  }

  absl::Status ReadCharacteristic(const std::string& item_id, double scale, bool zone, Characteristic* c) {
    const pugi::xml_node item = Find(kItems, item_id);
    if (!item) return Refuse("CharacteristicItemId", item_id, "an item of this document");
    c->name = TrimmedAt(item, "Name");
    if (c->name.empty()) c->name = TrimmedAt(item.child("CharacteristicDesignator"), "Designator");
    if (c->name.empty()) return Refuse("CharacteristicItem[" + item_id + "].Name", "", "a name or a designator");
    // Others measure an item in several places, and give names twice.
    const std::string told = c->name;
    for (int& count = counts_.emplace(told, 1).first->second; !names_.insert(c->name).second;)
      c->name = told + "#" + std::to_string(++count);
    const pugi::xml_node nominal = Find(kNominals, TrimmedAt(item, "CharacteristicNominalId"));
    const pugi::xml_node definition = Find(kDefinitions, TrimmedAt(nominal, "CharacteristicDefinitionId"));
    auto target = OptionalNumber("TargetValue", TextAt(nominal, "TargetValue"));
    if (!target.ok()) return target.status();
    if (!zone) c->nominal = scale * target->value_or(0);
    if (const auto kind = KindNamed(Ours(definition, qif::kKind))) c->kind = *kind;
    if (c->unit == "1") return ReadLimits(nominal, scale, c);
    return zone ? ReadZone(definition, scale, c) : ReadLimits(definition, scale, c);
  }

  absl::Status ReadZone(pugi::xml_node definition, double scale, Characteristic* c) {
    const auto width = OptionalNumber("ToleranceValue", TextAt(definition, "ToleranceValue"));
    if (!width.ok()) return width.status();
    const auto lower = OptionalNumber(qif::kLower, Ours(definition, qif::kLower));
    if (!lower.ok()) return lower.status();
    if (*width) c->upper = scale * **width / 2;
    c->lower = *lower;
    return absl::OkStatus();
  }

  absl::Status ReadLimits(pugi::xml_node definition, double scale, Characteristic* c) {
    const pugi::xml_node tolerance = c->unit == "1" ? definition : definition.child("Tolerance");
    if (!tolerance) {
      // Form and orientation have the width of a zone, which their value has, too.
      const auto width = OptionalNumber("ToleranceValue", TextAt(definition, "ToleranceValue"));
      if (!width.ok()) return width.status();
      if (*width) c->upper = scale * **width;
      return absl::OkStatus();
    }
    const std::string as_limit = TrimmedAt(tolerance, "DefinedAsLimit");
    const double base = as_limit == "true" || as_limit == "1" ? 0 : c->nominal;
    for (const auto& [name, limit] : {std::make_pair("MaxValue", &c->upper), std::make_pair("MinValue", &c->lower)}) {
      const auto number = OptionalNumber(name, TextAt(tolerance, name));
      if (!number.ok()) return number.status();
      if (*number) *limit = base + scale * **number;
    }
    return absl::OkStatus();
  }

  absl::Status ReadValue(pugi::xml_node node, const Unit& unit, bool zone, MeasuredValue* value) {
    const pugi::xml_node written = node.child("Value");
    for (const char* attribute : {"linearUnit", "angularUnit"})
      if (const std::string other = written.attribute(attribute).value(); !other.empty() && other != unit.name)
        return Refuse(std::string("Value.") + attribute, other, "the file's unit, " + unit.name);
    const double scale = zone ? *unit.scale / 2 : *unit.scale;
    const struct {
      const char* field;
      std::string text;
      double scale;
      std::optional<double>* number;
    } numbers[] = {
        {"Value", written.text().get(), scale, &value->value},
        {"Value.combinedUncertainty", written.attribute("combinedUncertainty").value(), 2 * scale,
         &value->expanded_uncertainty},
        {"WorstNegativeDeviation", TextAt(node, "WorstNegativeDeviation"), *unit.scale, &value->worst_negative},
        {"WorstPositiveDeviation", TextAt(node, "WorstPositiveDeviation"), *unit.scale, &value->worst_positive},
        {qif::kWorstNegative, Ours(node, qif::kWorstNegative), 1, &value->worst_negative},
        {qif::kWorstPositive, Ours(node, qif::kWorstPositive), 1, &value->worst_positive}};
    for (const auto& each : numbers) {
      const auto number = OptionalNumber(each.field, each.text);
      if (!number.ok()) return number.status();
      if (*number) *each.number = each.scale * **number;
    }
    ReadStatus(node, value);
    return absl::OkStatus();
  }

  // A value without a status that decides is undecidable; a status without a value is not measured. Neither is a pass.
  void ReadStatus(pugi::xml_node node, MeasuredValue* value) {
    std::string status = TrimmedAt(node.child("Status"), "CharacteristicStatusEnum");
    if (status.empty()) status = TrimmedAt(node.child("Status"), "OtherCharacteristicStatus");
    const auto told = VerdictOfQifStatus(status);
    value->reason = TextAt(node, "Description");
    if (!value->value) {
      value->expanded_uncertainty = value->worst_negative = value->worst_positive = std::nullopt;
      value->verdict = Verdict::kNotMeasured;
      if (told != Verdict::kNotMeasured && value->reason.empty()) value->reason = status + " without a value";
      return;
    }
    value->does_not_count = status == "SYSERROR";
    value->verdict = !told || *told == Verdict::kNotMeasured ? Verdict::kUndecidable : *told;
    if (value->reason.empty() && QifStatus(value->verdict) != status) value->reason = "status " + status;
  }

  pugi::xml_node root_, results_;
  Unit linear_, angular_;
  std::array<Nodes, 3> nodes_;
  std::set<std::string> names_;
  std::map<std::string, int> counts_;  // how far a name that stood more often is numbered
  InspectedPart part_;
};

}  // namespace

absl::StatusOr<InspectedPart> FromQif(std::string_view document) {
  if (const absl::Status status = CheckBytes(document); !status.ok()) return status;
  pugi::xml_document xml;
  const pugi::xml_parse_result parsed =
      xml.load_buffer(document.data(), document.size(), pugi::parse_default | pugi::parse_ws_pcdata_single);
  if (!parsed)
    return Refuse("document", "byte " + std::to_string(parsed.offset),
                  "XML that is whole: " + std::string(parsed.description()));
  if (const absl::Status status = CheckDepth(xml); !status.ok()) return status;
  const pugi::xml_node root = xml.document_element();
  if (std::string_view(root.name()) != "QIFDocument") return Refuse("document", root.name(), "QIFDocument");
  const std::string version(Trimmed(root.attribute("versionQIF").value()));
  if (version != "3.0.0") return Refuse("versionQIF", version, "3.0.0");
  return QifReader(root).Read();
}

}  // namespace sixpoint::exchange
