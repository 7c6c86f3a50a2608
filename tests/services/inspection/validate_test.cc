#include "services/inspection/validate.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace sixpoint::inspection {
namespace {

using ::testing::HasSubstr;

TEST(CheckInspect, NamesTheField) {
  v1::InspectRequest request;
  const auto message = [&] { return std::string(CheckInspect(request).message()); };
  EXPECT_THAT(message(), HasSubstr("blade: "));
  request.set_blade("blades/sn1");
  EXPECT_THAT(message(), HasSubstr("scans: 0 scans, want at least 1"));
  request.add_scans("scans/s1");
  EXPECT_TRUE(CheckInspect(request).ok());
  request.add_scans("scans/s1");
  EXPECT_THAT(message(), HasSubstr("scans[1]: scans/s1, want each scan once"));
  request.set_scans(1, "blades/s2");
  EXPECT_THAT(message(), HasSubstr("scans[1]"));
  request.set_scans(1, "scans/s2");
  EXPECT_TRUE(CheckInspect(request).ok());
}

TEST(CheckScan, WantsPinsOfTheBlade) {
  ingest::v1::ScanHeader header;
  header.set_scan_id("s1");
  header.set_subject("blades/sn2");
  header.set_kind(ingest::v1::SCAN_KIND_PINS);
  EXPECT_THAT(std::string(CheckScan(3, header, "blades/sn1").message()),
              HasSubstr("scans[3]: s1 of blades/sn2, want a scan of blades/sn1"));
  EXPECT_TRUE(CheckScan(3, header, "blades/sn2").ok());
  header.set_kind(ingest::v1::SCAN_KIND_AIRFOIL);
  EXPECT_THAT(std::string(CheckScan(3, header, "blades/sn2").message()), HasSubstr("SCAN_KIND_AIRFOIL"));
}

}  // namespace
}  // namespace sixpoint::inspection
