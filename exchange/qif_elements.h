// What all of a QIF document's elements are written with.
#pragma once

#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "exchange/xml_writer.h"

namespace sixpoint::exchange::qif {

using Named = std::vector<std::pair<std::string, std::string>>;

// The ids of a document's objects. Those of the plan come first, so that they are the same in each result document.
struct Ids {
  std::size_t count;            // characteristics
  std::size_t with_points = 0;  // one more than the last value's index that has points; 0: none has
  static constexpr std::size_t kStandard = 1, kPart = 2;
  static std::size_t Definition(std::size_t i) { return 3 + 3 * i; }
  static std::size_t Nominal(std::size_t i) { return 4 + 3 * i; }
  static std::size_t Item(std::size_t i) { return 5 + 3 * i; }
  std::size_t last_of_plan() const { return 2 + 3 * count; }
  std::size_t plan() const { return last_of_plan() + 1; }
  std::size_t software() const { return last_of_plan() + 2; }
  std::size_t device() const { return last_of_plan() + 3; }
  std::size_t tool() const { return last_of_plan() + 4; }
  std::size_t sensor() const { return last_of_plan() + 5; }
  std::size_t component() const { return last_of_plan() + 6; }
  std::size_t results() const { return last_of_plan() + 7; }
  std::size_t Measurement(std::size_t i) const { return last_of_plan() + 8 + i; }
  // Of the value's points. The last of all; of values without points there is none.
  std::size_t PointSet(std::size_t i) const { return last_of_plan() + 8 + count + i; }
  std::size_t last() const { return last_of_plan() + 7 + count + with_points; }
};

inline std::string Text(std::size_t number) { return std::to_string(number); }
inline XmlWriter::Attributes Id(std::size_t id) { return {{"id", Text(id)}}; }
inline XmlWriter::Attributes Count(std::size_t count) { return {{"n", Text(count)}}; }

inline void WriteAttributes(XmlWriter& xml, const Named& named) {
  if (named.empty()) return;
  xml.Open("Attributes", Count(named.size()));
  for (const auto& [name, value] : named) xml.Empty("AttributeStr", {{"name", name}, {"value", value}});
  xml.Close();
}

}  // namespace sixpoint::exchange::qif
