// Against what is not ours: the standard's schema, and other people's documents.
#include <gmock/gmock.h>
#include <unistd.h>

#include <iostream>

#include "exchange/qif.h"
#include "refusal/refusal.h"
#include "sample_part.h"

namespace sixpoint::exchange {
namespace {

class QifSchema : public ::testing::Test {
 protected:
  void SetUp() override {
    schema_ = SharedStandards() / "qif" / "schema" / "QIFDocument.xsd";
    if (!std::filesystem::exists(schema_)) GTEST_SKIP() << "no QIF schema under SIXPOINT_SHARED_DIR";
    if (std::system("command -v xmllint >/dev/null") != 0) GTEST_SKIP() << "no xmllint (libxml2-utils)";
    std::string pattern = (std::filesystem::temp_directory_path() / "sixpoint-qif-XXXXXX").string();
    folder_ = mkdtemp(pattern.data());
  }
  void TearDown() override {
    if (!folder_.empty()) std::filesystem::remove_all(folder_);
  }

  void ExpectValid(const absl::StatusOr<std::string>& document) {
    ASSERT_TRUE(document.ok()) << document.status();
    const std::filesystem::path file = folder_ / "document.qif", said = folder_ / "said";
    std::ofstream(file, std::ios::binary) << *document;
    const std::string command =
        "xmllint --nonet --noout --schema '" + schema_.string() + "' '" + file.string() + "' 2>'" + said.string() + "'";
    EXPECT_EQ(std::system(command.c_str()), 0) << FileText(said).substr(0, 3000);
  }
  void ExpectAllValid(const InspectedPart& part) {
    ExpectValid(ToQif(part));
    ExpectValid(QifPlanOf(part));
  }

  std::filesystem::path schema_, folder_;
};

TEST_F(QifSchema, AUsualPartIsValid) { ExpectAllValid(SamplePart(24)); }
TEST_F(QifSchema, OneCharacteristicIsValid) { ExpectAllValid(SamplePart(1)); }
TEST_F(QifSchema, TwoThousandCharacteristicsAreValid) { ExpectAllValid(SamplePart(2000)); }

TEST_F(QifSchema, PointsOfProfilesAreValid) {
  InspectedPart part = SamplePart(24);
  std::size_t sets = 0;
  for (std::size_t i = 0; i < part.values.size(); ++i)
    if (part.characteristics[i].kind == Characteristic::Kind::kProfile && part.values[i].value) {
      part.values[i].points = {{{1, 2, 3}, {0, 0, 1}, 0.01}, {{1, 2.5, 1e-9}, {0, 0.6, 0.8}, -0.02}};
      ++sets;
    }
  ASSERT_GE(sets, 2U);
  ExpectValid(ToQif(part));
  part.characteristics[2].lower = -0.5;  // no zone about nominal: its points alone
  ExpectValid(ToQif(part));
}

TEST_F(QifSchema, NothingMeasuredIsValid) {
  InspectedPart part = SamplePart(6);
  part.values.assign(6, MeasuredValue());
  part.verdict = Verdict::kNotMeasured;
  ExpectAllValid(part);
}

TEST_F(QifSchema, TextsThatNeedEscapingAreValid) {
  InspectedPart part = SamplePart(3);
  part.serial = "<SN> & \"1\"\t]]>\n-- \xc3\xbc '";
  part.part = part.machine = part.decision_rule = part.work_order = part.requested_by = part.sensor_model = part.serial;
  part.characteristics[0].name = "G<1>/\"H\"&1/position";
  part.values[0].reason = "<!-- --> &lt; <![CDATA[ ]]>";
  ExpectAllValid(part);
}

TEST_F(QifSchema, WithoutSensorAndEmptyTextsItIsValid) {
  InspectedPart part = SamplePart(3);
  for (const auto text : {&InspectedPart::serial, &InspectedPart::machine, &InspectedPart::sensor_model,
                          &InspectedPart::sensor_serial_number, &InspectedPart::work_order, &InspectedPart::operation,
                          &InspectedPart::requested_by, &InspectedPart::software_version, &InspectedPart::decision_rule,
                          &InspectedPart::method, &InspectedPart::registration})
    (part.*text).clear();
  part.calibrations.clear();
  part.scans.clear();
  ExpectAllValid(part);
}

TEST_F(QifSchema, SmallGreatAndOddNumbersAreValid) {
  InspectedPart part = SamplePart(12);
  for (std::size_t i = 0; i < part.values.size(); ++i) {
    Characteristic& c = part.characteristics[i];
    if (i >= 6) c.nominal = 1234567.25;
    if (i >= 9 && c.kind != Characteristic::Kind::kRatio) c.upper = c.lower = std::nullopt;
    if (i == 6) c.lower = -1e14;
    if (part.values[i].value) part.values[i].value = i % 2 ? 3.552713678800501e-15 : -123456789012345.6;
    if (part.values[i].value) part.values[i].expanded_uncertainty = 1e-300;
  }
  ExpectAllValid(part);
}

TEST_F(QifSchema, ADocumentThatIsNotValidIsFound) {
  const std::filesystem::path file = folder_ / "document.qif";
  std::string document = *ToQif(SamplePart(1));
  document.replace(document.find("PASS"), 4, "FINE");
  std::ofstream(file, std::ios::binary) << document;
  EXPECT_NE(
      std::system(
          ("xmllint --nonet --noout --schema '" + schema_.string() + "' '" + file.string() + "' 2>/dev/null").c_str()),
      0);
}

// Read, or refused by name.
TEST(QifSamples, OfOthersAreReadOrRefused) {
  const std::filesystem::path folder = SharedStandards() / "qif";
  if (!std::filesystem::exists(folder / "Results")) GTEST_SKIP() << "no QIF samples under SIXPOINT_SHARED_DIR";
  int read = 0, refused = 0;
  for (const char* part : {"Results", "ExternalReferencesAndQPIds"}) {
    for (const auto& entry : std::filesystem::recursive_directory_iterator(folder / part)) {
      const std::string suffix = entry.path().extension();
      if (suffix != ".QIF" && suffix != ".qif") continue;
      const auto result = FromQif(FileText(entry.path()));
      std::cout << entry.path().filename().string() << ": ";
      if (result.ok()) {
        std::size_t values = 0;
        for (const MeasuredValue& value : result->values) values += value.value.has_value();
        std::cout << "serial '" << result->serial << "', " << result->characteristics.size() << " characteristics, "
                  << values << " values\n";
        ++read;
      } else {
        std::cout << result.status().message() << "\n";
        EXPECT_FALSE(ViolationsOf(result.status()).empty()) << result.status();
        ++refused;
      }
    }
  }
  std::cout << read << " read, " << refused << " refused\n";
  EXPECT_GE(read, 14);
}

TEST(QifSamples, ASheetMetalPartHasItsValues) {
  const std::filesystem::path file =
      SharedStandards() / "qif" / "Results" / "Sheet_Metal" / "SheetMetal_QIF_Results_sample_1.QIF";
  if (!std::filesystem::exists(file)) GTEST_SKIP() << "no QIF samples under SIXPOINT_SHARED_DIR";
  const auto part = FromQif(FileText(file));
  ASSERT_TRUE(part.ok()) << part.status();
  for (std::size_t i = 0; i < part->values.size(); ++i)
    if (part->characteristics[i].name == "W1RXXMRA19P") {
      EXPECT_EQ(part->characteristics[i].kind, Characteristic::Kind::kPosition);
      // The file's 1.076016018900693 is the zone's diameter.
      EXPECT_EQ(part->values[i].value, 1.076016018900693 / 2);
      EXPECT_EQ(part->values[i].verdict, Verdict::kConform);
      return;
    }
  ADD_FAILURE() << "no W1RXXMRA19P";
}

}  // namespace
}  // namespace sixpoint::exchange
