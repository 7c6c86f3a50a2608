// What stores of results are asked beside the results, of PostgreSQL's and of the fakes: it is read by itself, and comes with no result.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "storage/blobs.h"
#include "tests/storage/result_store_fixture.h"
#include "tests/support/some_uuid.h"

namespace sixpoint::storage {
namespace {

using sixpoint::testing::Soon;
using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::IsNan;
using ::testing::SizeIs;

// Two, of which the second has no surface near it that looks alike. Numbers that a real has as they are.
const BlankPatchesRow kBlankPatches = {{1, 2, 3, 4, 5, 6}, {0, 0, 1, 0, 1, 0}, {2, 2.5}, {60.5, NAN}, {0, 1}};

void ExpectThose(const absl::StatusOr<std::optional<BlankPatchesRow>>& patches) {
  ASSERT_TRUE(patches.ok() && patches->has_value()) << patches.status();
  EXPECT_EQ((*patches)->points_in_part_mm, kBlankPatches.points_in_part_mm);
  EXPECT_EQ((*patches)->normals_in_part, kBlankPatches.normals_in_part);
  EXPECT_EQ((*patches)->expanded_uncertainties_um, kBlankPatches.expanded_uncertainties_um);
  EXPECT_THAT((*patches)->stock_um, ElementsAre(60.5, IsNan()));
  EXPECT_EQ((*patches)->regions, kBlankPatches.regions);
}

// Neither of a UUID that nothing has nor of what is none.
template <typename Store>
void ExpectNoPatchesOfWhatIsNotThere(const Store& store) {
  for (const std::string& id : {NewUuid(), std::string("no-uuid")}) {
    const auto patches = store.Patches(id, Soon());
    ASSERT_TRUE(patches.ok()) << patches.status();
    EXPECT_FALSE(patches->has_value()) << id;
  }
}

using DeviationReads = ResultStoreTest<StoredDeviations>;

TEST_F(DeviationReads, PatchesAreReadByThemselves) {
  OnBoth([](DeviationStore& store, int) {
    DeviationMapRow row = New();
    row.patch_count = 2;
    row.patches = {{1, 2, 3, 4, 5, 6}, {0, 0, 1, 0, 1, 0}, {0.5, 1.5}, {-3.5, NAN}, {0.25, NAN}, {100, 0}};
    ASSERT_TRUE(Record(store, row).ok());
    const auto patches = store.Patches(row.deviation_id, Soon());
    ASSERT_TRUE(patches.ok() && patches->has_value()) << patches.status();
    EXPECT_EQ((*patches)->centres_in_part_mm, row.patches.centres_in_part_mm);
    EXPECT_EQ((*patches)->normals_in_part, row.patches.normals_in_part);
    EXPECT_THAT((*patches)->areas_mm2, ElementsAre(0.5, 1.5));
    EXPECT_THAT((*patches)->means_um, ElementsAre(-3.5, IsNan()));
    EXPECT_THAT((*patches)->expanded_uncertainties_um, ElementsAre(0.25, IsNan()));
    EXPECT_THAT((*patches)->point_counts, ElementsAre(100, 0));
    EXPECT_THAT((**store.Find(row.deviation_id, Soon())).patches.areas_mm2, IsEmpty());
    EXPECT_THAT(store.List({}, 0, 1, Soon())->front().patches.areas_mm2, IsEmpty());
    ExpectNoPatchesOfWhatIsNotThere(store);
  });
}

TEST_F(DeviationReads, ACloudIsReadBlockByBlockInItsOrder) {
  OnBoth([](DeviationStore& store, int) {
    DeviationMapRow row = New();
    ASSERT_TRUE(Record(store, row).ok());
    const auto none = store.Cloud(row.deviation_id, Soon());
    ASSERT_TRUE(none.ok()) << none.status();
    EXPECT_THAT(*none, IsEmpty());
    row = New();
    row.cloud_bytes = {"one block", "another block"};
    row.cloud = {{1, 20, 0.5, 0.01, Sha256Hex("one block")}, {0, 10, 0.25, 0.02, Sha256Hex("another block")}};
    row.cloud_sha256 = Sha256OfDigests({row.cloud[0].blob_sha256, row.cloud[1].blob_sha256});
    ASSERT_TRUE(Record(store, row).ok());
    const auto cloud = store.Cloud(row.deviation_id, Soon());
    ASSERT_TRUE(cloud.ok()) << cloud.status();
    ASSERT_THAT(*cloud, SizeIs(2));
    for (std::size_t i = 0; i < 2; ++i) {
      EXPECT_EQ((*cloud)[i].scan_index, row.cloud[i].scan_index);
      EXPECT_EQ((*cloud)[i].point_count, row.cloud[i].point_count);
      EXPECT_EQ((*cloud)[i].proven_place_error_um, row.cloud[i].proven_place_error_um);
      EXPECT_EQ((*cloud)[i].proven_deviation_error_um, row.cloud[i].proven_deviation_error_um);
      EXPECT_EQ(*store.CloudBytes((*cloud)[i].blob_sha256, Soon()), row.cloud_bytes[i]);
    }
    const DeviationMapRow read = **store.Find(row.deviation_id, Soon());
    EXPECT_EQ(read.cloud_sha256, row.cloud_sha256);
    EXPECT_THAT(read.cloud, IsEmpty());
    EXPECT_THAT(read.cloud_bytes, IsEmpty());
    EXPECT_THAT(*store.Cloud("no-uuid", Soon()), IsEmpty());
    EXPECT_EQ(store.CloudBytes(std::string(64, 'e'), Soon()).status().code(), absl::StatusCode::kNotFound);
  });
}

TEST_F(DeviationReads, ACloudOfOtherBytesThanItsDigestIsNotRecorded) {
  OnBoth([](DeviationStore& store, int) {
    DeviationMapRow row = New();
    row.cloud_bytes = {"one block"};
    row.cloud = {{0, 20, 0.5, 0.01, Sha256Hex("another block")}};
    row.cloud_sha256 = Sha256OfDigests({row.cloud[0].blob_sha256});
    EXPECT_EQ(Record(store, row, sixpoint::testing::kSomeUuid).status().code(), absl::StatusCode::kInternal);
    EXPECT_FALSE(store.Find(row.deviation_id, Soon())->has_value());
    EXPECT_FALSE(store.FindRecorded({"area.Call", sixpoint::testing::kSomeUuid, "request"}, Soon())->has_value());
  });
}

using SectionReads = ResultStoreTest<StoredSections>;

TEST_F(SectionReads, OutlinesAreReadByThemselvesInTheOrderOfTheSections) {
  OnBoth([](SectionStore& store, int) {
    SectionMeasurementRow row = New();
    SectionRow& unseen = row.sections.emplace_back(row.sections.front());
    unseen.section = "90 %";
    unseen.found.reset();
    unseen.reason = "no point was seen there";
    unseen.values = {{"CHORD_NOSE_TAIL", "MM", 28, {}, {}, {}, {}, {}, "not seen"}};
    row.outlines.push_back({{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 9}, {0, 0, 2, 0, 0, 2}, {}, {}, {}});
    ASSERT_TRUE(Record(store, row).ok());
    const auto outlines = store.Outlines(row.section_measurement_id, Soon());
    ASSERT_TRUE(outlines.ok()) << outlines.status();
    ASSERT_THAT(*outlines, SizeIs(2));
    for (std::size_t i = 0; i < 2; ++i) {
      EXPECT_EQ((*outlines)[i].part_from_section, row.outlines[i].part_from_section);
      EXPECT_EQ((*outlines)[i].nominal_mm, row.outlines[i].nominal_mm);
      EXPECT_EQ((*outlines)[i].measured_mm, row.outlines[i].measured_mm);
      EXPECT_EQ((*outlines)[i].deviations_um, row.outlines[i].deviations_um);
      EXPECT_EQ((*outlines)[i].gaps_before, row.outlines[i].gaps_before);
    }
    EXPECT_THAT((**store.Find(row.section_measurement_id, Soon())).outlines, IsEmpty());
    for (const std::string& id : {NewUuid(), std::string("no-uuid")})
      EXPECT_THAT(*store.Outlines(id, Soon()), IsEmpty()) << id;
  });
}

TEST_F(SectionReads, AListHasValuesWhereTheyAreAskedFor) {
  OnBoth([](SectionStore& store, int) {
    const SectionMeasurementRow row = New();
    ASSERT_TRUE(Record(store, row).ok());
    SectionFilter filter;
    EXPECT_THAT(store.List(filter, 0, 1, Soon())->front().sections.front().values, SizeIs(2));
    filter.with_values = false;
    const SectionMeasurementRow without = store.List(filter, 0, 1, Soon())->front();
    ASSERT_THAT(without.sections, SizeIs(1));
    EXPECT_EQ(without.sections.front().section, "50 %");
    EXPECT_THAT(without.sections.front().values, IsEmpty());
    EXPECT_THAT((**store.Find(row.section_measurement_id, Soon())).sections.front().values, SizeIs(2));
  });
}

using ReconstructionReads = ResultStoreTest<StoredReconstructions>;

TEST_F(ReconstructionReads, PatchesAndTheLatticeAreReadByThemselves) {
  OnBoth([](ReconstructionStore& store, int) {
    ReconstructionRow row = New();
    row.patches = kBlankPatches;
    ASSERT_TRUE(Record(store, row).ok());
    ExpectThose(store.Patches(row.reconstruction_id, Soon()));
    const auto lattice = store.Lattice(row.lattice_sha256, Soon());
    ASSERT_TRUE(lattice.ok()) << lattice.status();
    EXPECT_EQ(*lattice, row.lattice);
    const ReconstructionRow read = **store.Find(row.reconstruction_id, Soon());
    EXPECT_EQ(read.lattice_sha256, row.lattice_sha256);
    EXPECT_EQ(read.lattice, "");
    EXPECT_THAT(read.patches.stock_um, IsEmpty());
    ExpectNoPatchesOfWhatIsNotThere(store);
    EXPECT_EQ(store.Lattice(std::string(64, 'e'), Soon()).status().code(), absl::StatusCode::kNotFound);
  });
}

TEST_F(ReconstructionReads, ALatticeOfOtherBytesThanItsDigestIsNotRecorded) {
  OnBoth([](ReconstructionStore& store, int) {
    ReconstructionRow row = New();
    row.lattice = "another lattice";
    EXPECT_EQ(Record(store, row).status().code(), absl::StatusCode::kInternal);
    EXPECT_FALSE(store.Find(row.reconstruction_id, Soon())->has_value());
  });
}

using MachiningPassReads = ResultStoreTest<StoredMachiningPasses>;

TEST_F(MachiningPassReads, PatchesAreReadByThemselves) {
  OnBoth([](MachiningPassStore& store, int) {
    MachiningPassRow row = New();
    row.patches = kBlankPatches;
    ASSERT_TRUE(Record(store, row).ok());
    ExpectThose(store.Patches(row.pass_id, Soon()));
    EXPECT_THAT((**store.Find(row.pass_id, Soon())).patches.stock_um, IsEmpty());
    ExpectNoPatchesOfWhatIsNotThere(store);
  });
}

using RepairReads = ResultStoreTest<StoredRepairs>;

TEST_F(RepairReads, ContoursAndLapsAreReadByThemselvesInTheirOrder) {
  OnBoth([](RepairStore& store, int) {
    RepairRow row = New();
    row.contours = {{{1, 2, 38}, {8.5}, {-5}}, {{1, 2, 39, 4, 5, 39}, {8, 9}, {5, 0.5}}};
    row.laps = {{39, 0.1, {1, 2, 39}, {0, 0, 1}}, {38, 0, {1, 2, 38, 4, 5, 38}, {0, 0, 1, 0, 1, 0}}};
    ASSERT_TRUE(Record(store, row).ok());
    const auto contours = store.Contours(row.repair_id, Soon());
    ASSERT_TRUE(contours.ok()) << contours.status();
    ASSERT_THAT(*contours, SizeIs(2));
    const auto laps = store.Laps(row.repair_id, Soon());
    ASSERT_TRUE(laps.ok()) << laps.status();
    ASSERT_THAT(*laps, SizeIs(2));
    for (std::size_t i = 0; i < 2; ++i) {
      EXPECT_EQ((*contours)[i].points_in_part_mm, row.contours[i].points_in_part_mm);
      EXPECT_EQ((*contours)[i].expanded_uncertainties_um, row.contours[i].expanded_uncertainties_um);
      EXPECT_EQ((*contours)[i].rest_um, row.contours[i].rest_um);
      EXPECT_EQ((*laps)[i].z_mm, row.laps[i].z_mm);
      EXPECT_EQ((*laps)[i].allowance_mm, row.laps[i].allowance_mm);
      EXPECT_EQ((*laps)[i].centres_in_part_mm, row.laps[i].centres_in_part_mm);
      EXPECT_EQ((*laps)[i].axes_in_part, row.laps[i].axes_in_part);
    }
    const RepairRow read = **store.Find(row.repair_id, Soon());
    EXPECT_THAT(read.contours, IsEmpty());
    EXPECT_THAT(read.laps, IsEmpty());
    EXPECT_THAT(read.sections, SizeIs(1));
    for (const std::string& id : {NewUuid(), std::string("no-uuid")}) {
      EXPECT_THAT(*store.Contours(id, Soon()), IsEmpty()) << id;
      EXPECT_THAT(*store.Laps(id, Soon()), IsEmpty()) << id;
    }
  });
}

}  // namespace
}  // namespace sixpoint::storage
