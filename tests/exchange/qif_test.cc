#include "exchange/qif.h"

#include <gmock/gmock.h>

#include <chrono>
#include <cmath>
#include <functional>
#include <set>
#include <sstream>

#include "exchange/text.h"
#include "sample_part.h"

namespace sixpoint::exchange {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;
using Kind = Characteristic::Kind;

// Each id="..." of a document.
std::vector<long> IdsOf(const std::string& document) {
  std::vector<long> ids;
  for (std::size_t at = 0; (at = document.find(" id=\"", at)) != std::string::npos;)
    ids.push_back(std::stol(document.substr(at += 5)));
  return ids;
}

void ExpectIdsAreRight(const std::string& document) {
  const std::vector<long> ids = IdsOf(document);
  const std::set<long> once(ids.begin(), ids.end());
  EXPECT_EQ(ids.size(), once.size());
  EXPECT_THAT(document, HasSubstr("idMax=\"" + std::to_string(*once.rbegin()) + "\""));
}

InspectedPart Hostile() {
  InspectedPart part = SamplePart(3);
  part.serial = "<SN> & \"1\"\t]]>\n-- \xc3\xbc '";
  part.part = "&amp;";
  part.decision_rule = "a < b\r\nc > d";
  part.work_order = "  ";
  part.characteristics[0].name = "G<1>/\"H\"&1/position";
  part.values[2].reason = "<!-- --> &lt; <![CDATA[ ]]>";
  part.sensor_model.clear();
  part.sensor_serial_number.clear();
  return part;
}

InspectedPart NothingMeasured() {
  InspectedPart part = SamplePart(5);
  for (MeasuredValue& value : part.values) {
    value = MeasuredValue();
    value.reason = "no scan shows it";
  }
  part.verdict = Verdict::kNotMeasured;
  return part;
}

// Limits that a zone about nominal cannot tell.
InspectedPart OddLimits() {
  InspectedPart part = SamplePart(12);
  for (Characteristic& c : part.characteristics) c.nominal = 0.25;
  part.characteristics[0].upper.reset();
  part.characteristics[1].lower = 0.01;
  part.characteristics[2].nominal = 0;
  part.characteristics[2].lower = -0.5;
  part.characteristics[5].lower.reset();
  part.characteristics[4].upper.reset();
  part.characteristics[6].nominal = 0;
  part.characteristics[6].lower = 0;
  part.characteristics[8].nominal = 0;
  part.characteristics[8].lower.reset();
  return part;
}

TEST(Qif, AResultComesBackToTheBit) {
  for (const InspectedPart& part :
       {SamplePart(1), SamplePart(80), SamplePart(2000), Hostile(), NothingMeasured(), OddLimits()}) {
    const auto document = ToQif(part);
    ASSERT_TRUE(document.ok()) << document.status();
    ExpectIdsAreRight(*document);
    ASSERT_TRUE(QifPlanOf(part).ok());
    ExpectIdsAreRight(*QifPlanOf(part));
    const auto back = FromQif(*document);
    ASSERT_TRUE(back.ok()) << back.status();
    ExpectSame(part, *back);
  }
}

TEST(Qif, APositionIsTheDiameterOfAZone) {
  InspectedPart part = SamplePart(1);
  part.characteristics[0].upper = 0.1;
  part.values[0].value = 0.03;
  part.values[0].expanded_uncertainty = 0.01;
  const std::string document = *ToQif(part);
  EXPECT_THAT(document, HasSubstr("<ToleranceValue>0.2</ToleranceValue>"));
  EXPECT_THAT(document, HasSubstr("<DiametricalZone/>"));
  // Twice the distance; and of that the standard uncertainty, 2 x U / 2.
  EXPECT_THAT(document, HasSubstr("<Value combinedUncertainty=\"0.01\" meanError=\"0\">0.06</Value>"));
}

TEST(Qif, WhatWasNotMeasuredHasNoValue) {
  const std::string document = *ToQif(NothingMeasured());
  EXPECT_THAT(document, Not(HasSubstr("<Value")));
  EXPECT_THAT(document, HasSubstr("<CharacteristicStatusEnum>NOT_ANALYZED"));
  EXPECT_THAT(document, HasSubstr("<Description>no scan shows it</Description>"));
  EXPECT_THAT(document, HasSubstr("<InspectionStatusEnum>NOT_MEASURED"));
}

TEST(Qif, TheSameNamesHaveTheSameIds) {
  const InspectedPart part = SamplePart(2);
  InspectedPart revised = part, renamed = part, wider = part, unlimited = part, named = part;
  revised.part_revision += 1;
  renamed.part += "3";
  *wider.characteristics[1].upper += 0.001;
  unlimited.characteristics[1].upper = std::nullopt;
  named.characteristics[1].name += "b";
  const std::set<std::string> ids = {QifPlanId(part),
                                     QifPlanId(revised),
                                     QifPlanId(renamed),
                                     QifPlanId(wider),
                                     QifPlanId(unlimited),
                                     QifPlanId(named),
                                     QifDocumentId("vane"),
                                     QifDocumentId("inspections/1"),
                                     QifCharacteristicId("vane", 3, "a"),
                                     QifCharacteristicId("vane", 3, "b"),
                                     QifPlanId({})};
  EXPECT_EQ(ids.size(), 11u);
  EXPECT_EQ(UuidOf(QifPlanId(part)), QifPlanId(part));
  EXPECT_EQ(QifPlanId(part)[14], '8');
  InspectedPart measured_otherwise = part;
  measured_otherwise.values = SamplePart(2, 7).values;
  EXPECT_EQ(QifPlanId(measured_otherwise), QifPlanId(part));
  // They are in customers' files: they stay.
  EXPECT_EQ(QifDocumentId("inspections/1"), "e02806d2-23de-894e-9add-1ca991e8331b");
  const std::string document = *ToQif(part), plan = *QifPlanOf(part);
  EXPECT_THAT(plan, HasSubstr("<QPId>" + QifPlanId(part)));
  for (const std::string& id : {QifPlanId(part), QifDocumentId(part.result), *UuidOf(part.result)})
    EXPECT_THAT(document, HasSubstr(id));
  // The plan's characteristics stand in the results as they are there.
  const auto characteristics = [](const std::string& text) {
    const std::size_t begin = text.find("<Characteristics>");
    return text.substr(begin, text.find("</Characteristics>") - begin);
  };
  EXPECT_EQ(characteristics(document), characteristics(plan));
}

TEST(Qif, APlanWritesItsOwnResultsAlone) {
  const InspectedPart part = SamplePart(12);
  const auto plan = QifPlan::Of(part);
  ASSERT_TRUE(plan.ok()) << plan.status();
  InspectedPart other = SamplePart(12, 7);
  EXPECT_TRUE(plan->IsOf(other));
  EXPECT_EQ(*plan->ResultDocument(other), *ToQif(other));
  EXPECT_EQ(plan->PlanDocument(), *QifPlanOf(other));
  other.characteristics[3].upper = 17;
  EXPECT_FALSE(plan->IsOf(other));
  EXPECT_THAT(std::string(plan->ResultDocument(other).status().message()),
              HasSubstr("those of the plan " + plan->id()));
}

TEST(Qif, WhatItCannotSayIsRefused) {
  const auto refused = [](const std::function<void(InspectedPart*)>& change) {
    InspectedPart part = SamplePart(3);
    change(&part);
    EXPECT_EQ(QifPlanOf(part).ok(), ToQif(part).ok() || part.result == "inspections/1");
    return std::string(ToQif(part).status().message());
  };
  EXPECT_THAT(refused([](InspectedPart* p) { p->result = "inspections/1"; }), HasSubstr("result: inspections/1"));
  EXPECT_THAT(refused([](InspectedPart* p) { p->serial = "\x01"; }), HasSubstr("serial"));
  EXPECT_THAT(refused([](InspectedPart* p) { p->values.pop_back(); }), HasSubstr("values: 2"));
  EXPECT_THAT(refused([](InspectedPart* p) { p->values[0].points.resize(1); }), HasSubstr("values[0].points: 1"));
  EXPECT_THAT(refused([](InspectedPart* p) {
                p->values[2].points = {{{1, 2, NAN}, {0, 0, 1}, 0}};
              }),
              HasSubstr("values[2].points"));
  EXPECT_THAT(refused([](InspectedPart* p) { p->characteristics.clear(), p->values.clear(); }),
              HasSubstr("characteristics: empty"));
  EXPECT_THAT(refused([](InspectedPart* p) { p->characteristics[1].name = p->characteristics[0].name; }),
              HasSubstr("each name once"));
  EXPECT_THAT(refused([](InspectedPart* p) { p->characteristics[1].unit = "mm"; }), HasSubstr("want deg"));
  EXPECT_THAT(refused([](InspectedPart* p) { p->characteristics[0].kind = Kind::kOther; }), HasSubstr("kind: other"));
  EXPECT_THAT(refused([](InspectedPart* p) { p->values[0].value = std::nan(""); }), HasSubstr("values[0].value: NaN"));
  EXPECT_THAT(refused([](InspectedPart* p) { p->values[0].value.reset(); }), HasSubstr("values[0].verdict: CONFORM"));
  EXPECT_THAT(refused([](InspectedPart* p) { p->values[0].expanded_uncertainty = -1; }), HasSubstr(">= 0"));
  EXPECT_THAT(refused([](InspectedPart* p) { p->values[0].worst_positive = 1; }), HasSubstr("none beside profiles"));
}

std::string Replaced(std::string text, const std::string& what, const std::string& by) {
  const std::size_t at = text.find(what);
  EXPECT_NE(at, std::string::npos) << what;
  return text.replace(at, what.size(), by);
}

TEST(Qif, HostileAndBrokenDocumentsAreRefused) {
  const std::string good = *ToQif(SamplePart(8));
  const auto refused = [](const std::string& document) {
    const auto part = FromQif(document);
    EXPECT_EQ(part.status().code(), absl::StatusCode::kInvalidArgument);
    return std::string(part.status().message());
  };
  EXPECT_THAT(refused(""), HasSubstr("document"));
  EXPECT_THAT(refused(std::string(kMostQifBytes + 1, ' ')), HasSubstr("bytes"));
  EXPECT_THAT(refused("<!DOCTYPE a [<!ENTITY b \"bb\"><!ENTITY c \"&b;&b;\">]>" + good), HasSubstr("no document type"));
  EXPECT_THAT(refused("<a/>"), HasSubstr("want QIFDocument"));
  EXPECT_THAT(refused(Replaced(good, "versionQIF=\"3.0.0\"", "versionQIF=\"2.1.0\"")), HasSubstr("versionQIF: 2.1.0"));
  EXPECT_THAT(
      refused(Replaced(good, "CharacteristicMeasurements n=\"8\"", "CharacteristicMeasurements n=\"4000000000\"")),
      HasSubstr("4000000000, want 8"));
  EXPECT_THAT(refused(Replaced(good, "<Factor>0.001</Factor>", "<Factor>-1</Factor>")), HasSubstr("Factor: -1"));
  EXPECT_THAT(refused(Replaced(good, "<CharacteristicItemId>5<", "<CharacteristicItemId>999<")), HasSubstr("999"));
  EXPECT_THAT(refused(Replaced(good, "<CharacteristicItemId>5<", "<CharacteristicItemId xId=\"5\">1<")),
              HasSubstr("another document"));
  EXPECT_THAT(refused(Replaced(good, "</Value>", "x</Value>")), HasSubstr("a number"));
  EXPECT_THAT(refused(Replaced(good, "<ToleranceValue>", "<ToleranceValue>1e999")), HasSubstr("ToleranceValue"));
  EXPECT_THAT(refused(Replaced(good, "<Value", "<Value linearUnit=\"inch\"")), HasSubstr("linearUnit: inch"));
  std::string deep;
  for (int i = 0; i < 200000; ++i) deep += "<a>";
  for (int i = 0; i < 200000; ++i) deep += "</a>";
  EXPECT_THAT(refused(deep), HasSubstr("deep"));
  std::string many = "<a ";
  for (int i = 0; i < 2100000; ++i) many += "b='' ";
  EXPECT_THAT(refused(many + "/>"), HasSubstr("quotes"));
  EXPECT_THAT(refused(std::string(4000000, '<')), HasSubstr("tags"));
}

// Others measure a characteristic in several places.
TEST(Qif, TwoMeasurementsOfOneItemAreTwo) {
  const InspectedPart part = SamplePart(4);
  const auto back = FromQif(Replaced(*ToQif(part), "<CharacteristicItemId>14<", "<CharacteristicItemId>5<"));
  ASSERT_TRUE(back.ok()) << back.status();
  EXPECT_EQ(back->characteristics[0].name, "G1/H0/position");
  EXPECT_EQ(back->characteristics[3].name, "G1/H0/position#2");
  EXPECT_EQ(back->values[0].value, part.values[0].value);
}

TEST(Qif, WithoutUnitsNoValueIsRead) {
  std::string document = *ToQif(SamplePart(1));
  const std::size_t begin = document.find("<LinearUnit>"), end = document.find("</LinearUnit>");
  document.erase(begin, end + 13 - begin);
  EXPECT_THAT(std::string(FromQif(document).status().message()), HasSubstr("LinearUnit"));
}

TEST(Qif, AnotherUnitIsConverted) {
  const InspectedPart part = SamplePart(1);
  const std::string inches = Replaced(*ToQif(part), "<Factor>0.001</Factor>", "<Factor>0.0254</Factor>");
  const auto back = FromQif(inches);
  ASSERT_TRUE(back.ok()) << back.status();
  EXPECT_NEAR(*back->values[0].value, 25.4 * *part.values[0].value, 1e-12);
  EXPECT_NEAR(*back->characteristics[0].upper, 25.4 * *part.characteristics[0].upper, 1e-12);
}

TEST(Qif, AStatusThatSaysNothingIsNeverAPass) {
  const std::string good = *ToQif(SamplePart(1));
  for (const char* status : {"UNDEFINED", "SYSERROR", "NOT_ANALYZED", "whatever"}) {
    const auto part =
        FromQif(Replaced(good, "<CharacteristicStatusEnum>PASS", std::string("<CharacteristicStatusEnum>") + status));
    ASSERT_TRUE(part.ok()) << part.status();
    EXPECT_EQ(part->values[0].verdict, Verdict::kUndecidable);
    EXPECT_THAT(part->values[0].reason, HasSubstr(status));
  }
}

// Each prefix, and a byte changed at each place: read or refused, and nothing else.
TEST(Qif, AnyBytesAreReadOrRefused) {
  const std::string good = *ToQif(SamplePart(3));
  std::mt19937 random(1);
  for (std::size_t size = 0; size < good.size(); size += 7) {
    const auto part = FromQif(std::string_view(good).substr(0, size));
    EXPECT_FALSE(part.ok()) << size;
  }
  for (std::size_t at = 0; at < good.size(); ++at) {
    std::string changed = good;
    changed[at] = static_cast<char>(random());
    const auto part = FromQif(changed);
    EXPECT_TRUE(!part.ok() || Check(*part).ok());
  }
}

TEST(Qif, AThousandPartsAreWritten) {
  const InspectedPart part = SamplePart(80);
  const auto begin = std::chrono::steady_clock::now();
  std::size_t bytes = 0;
  for (int i = 0; i < 1000; ++i) bytes += ToQif(part)->size();
  const std::chrono::duration<double> wall_s = std::chrono::steady_clock::now() - begin;
  std::printf("1000 parts of 80 values: %.1f MB in %.2f s, %.0f parts a second\n", bytes / 1e6, wall_s.count(),
              1000 / wall_s.count());
  EXPECT_GT(bytes, 10000000u);
}

}  // namespace
}  // namespace sixpoint::exchange
