#include "exchange/qif_points.h"

#include <algorithm>
#include <string>

#include "exchange/qif_words.h"
#include "exchange/text.h"

namespace sixpoint::exchange::qif {
namespace {

bool HasPoints(const MeasuredValue& value) { return !value.points.empty(); }

// Where the surface was found: from each nominal place along its normal.
void WritePointSet(XmlWriter& xml, const Characteristic& c, const std::vector<DeviationPoint>& points, std::size_t id,
                   const Ids& ids) {
  std::string places, normals;
  for (const DeviationPoint& point : points)
    for (std::size_t k = 0; k < 3; ++k) {
      for (std::string* text : {&places, &normals})
        if (!text->empty()) *text += ' ';
      places += DecimalText(point.nominal_mm[k] + point.deviation_mm * point.normal[k]);
      normals += DecimalText(point.normal[k]);
    }
  xml.Open("MeasuredPointSet", {{"id", Text(id)}, {"count", Text(points.size())}});
  WriteAttributes(xml, {{qif::kCharacteristic, c.name}});
  xml.Element("Points", places).Element("Normals", normals).Element("Compensated", "true");
  xml.Element("MeasurementDeviceId", Text(ids.device())).Close();
}

}  // namespace

std::size_t WithPoints(const InspectedPart& part) {
  const auto last = std::find_if(part.values.rbegin(), part.values.rend(), HasPoints);
  return static_cast<std::size_t>(part.values.rend() - last);
}

void WritePointSets(XmlWriter& xml, const InspectedPart& part, const Ids& ids) {
  if (ids.with_points == 0) return;
  const auto count = std::count_if(part.values.begin(), part.values.end(), HasPoints);
  xml.Open("MeasuredPointSets", Count(static_cast<std::size_t>(count)));
  for (std::size_t i = 0; i < ids.with_points; ++i)
    if (HasPoints(part.values[i]))
      WritePointSet(xml, part.characteristics[i], part.values[i].points, ids.PointSet(i), ids);
  xml.Close();
}

void WritePointDeviations(XmlWriter& xml, const std::vector<DeviationPoint>& points, std::size_t point_set) {
  xml.Open("PointDeviations", Count(points.size()));
  for (std::size_t i = 0; i < points.size(); ++i) {
    xml.Open("PointDeviation").Element("MeasurePointId", Text(point_set), {{"index", Text(i + 1)}});
    xml.Element("Deviation", DecimalText(points[i].deviation_mm)).Close();
  }
  xml.Close();
}

}  // namespace sixpoint::exchange::qif
