// The handlers of reconstructions on a fake store: no PostgreSQL, and no shape is fitted.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "services/correction/reconstruction_service.h"
#include "storage/blobs.h"
#include "tests/services/correction/stand_ins.h"
#include "tests/support/call.h"
#include "tests/support/fake_reconstructions.h"
#include "tests/support/listed_results.h"
#include "tests/support/must.h"
#include "tests/support/sample_results.h"
#include "tests/support/some_uuid.h"

namespace sixpoint::correction {
namespace {

using sixpoint::testing::kSomeUuid;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

class ReconstructionHandlersTest : public ::testing::Test {
 protected:
  using Row = storage::ReconstructionRow;
  using Stub = v1::ReconstructionService::Stub;

  static Row Sample() {
    Row row = testing::SampleReconstruction();
    row.blade_serial = "sn1";
    row.part_id = "p1";
    row.registration_id = std::string(testing::kRegistration).substr(14);
    row.scan_ids = {"s0", "s1"};
    return row;
  }
  // Of the same blank, that it contains no shape.
  static Row Infeasible() {
    Row row = Sample();
    row.outcome = "INFEASIBLE";
    row.remark = "the stock is too small at the edge";
    row.lattice.clear();
    row.lattice_sha256.clear();
    row.worst_step_um.reset();
    row.worst_kink_deg.reset();
    row.proof = storage::ShapeProofRow{true, 12, 3, storage::ShapeProofRow::Relaxation{10, 14}, std::nullopt};
    return row;
  }
  // As if the request had been answered with it; gives its name.
  std::string Put(Row row = Sample(), const v1::ReconstructRequest& request = {}) {
    row.reconstruction_id = storage::NewUuid();
    testing::Must(
        store_->Record(runtime::RecordedRequestOf("correction.Reconstruct", request, ""), row, {}, {}).status());
    return "reconstructions/" + row.reconstruction_id;
  }
  static v1::ReconstructRequest Request(const std::string& request_id = "") {
    v1::ReconstructRequest request;
    request.set_registration(testing::kRegistration);
    request.set_request_id(request_id);
    return request;
  }
  absl::StatusOr<v1::Reconstruction> Reconstruct(const v1::ReconstructRequest& request) {
    return testing::Call(*stub_, &Stub::Reconstruct, request);
  }
  absl::StatusOr<v1::Reconstruction> Get(const std::string& name) {
    v1::GetReconstructionRequest request;
    request.set_name(name);
    return testing::Call(*stub_, &Stub::GetReconstruction, request);
  }
  absl::StatusOr<v1::ListReconstructionsResponse> List(const v1::ListReconstructionsRequest& request) {
    return testing::Call(*stub_, &Stub::ListReconstructions, request);
  }
  testing::Streamed<v1::BlankPatches> Patches(const std::string& name) {
    v1::DownloadBlankPatchesRequest request;
    request.set_name(name);
    return testing::CallStream(*stub_, &Stub::DownloadBlankPatches, request);
  }
  testing::Streamed<v1::LatticePiece> Lattice(const std::string& name) {
    v1::DownloadLatticeRequest request;
    request.set_name(name);
    return testing::CallStream(*stub_, &Stub::DownloadLattice, request);
  }
  // Of every handler that is given a name.
  std::vector<absl::Status> StatusesOf(const std::string& name) {
    v1::ReplayReconstructionRequest replay;
    replay.set_name(name);
    return {Get(name).status(), Patches(name).status, Lattice(name).status,
            testing::Call(*stub_, &Stub::ReplayReconstruction, replay).status()};
  }

  testing::StandIns plant_;
  std::shared_ptr<testing::FakeReconstructions> store_ = std::make_shared<testing::FakeReconstructions>();
  ReconstructionService service_{
      store_,
      std::make_unique<clients::BladePeers>(plant_.Connect(), plant_.Connect(), plant_.Connect(), plant_.Connect()),
      {1, 0},
      1};
  testing::InProcessServer server_{{&service_}};
  std::unique_ptr<Stub> stub_ = v1::ReconstructionService::NewStub(server_.Connect());
};

TEST_F(ReconstructionHandlersTest, AReconstructionIsReadByItsName) {
  const std::string infeasible = Put(Infeasible()), name = Put();
  const auto found = Get(name);
  ASSERT_TRUE(found.ok()) << found.status();
  EXPECT_EQ(found->name(), name);
  EXPECT_EQ(found->blade(), "blades/sn1");
  EXPECT_EQ(found->registration(), testing::kRegistration);
  EXPECT_THAT(found->scans(), ElementsAre("scans/s0", "scans/s1"));
  EXPECT_EQ(found->record_sequence(), 2);
  EXPECT_EQ(found->outcome(), v1::RECONSTRUCTION_OUTCOME_RECONSTRUCTED);
  EXPECT_EQ(found->worst_step_um(), 1);
  EXPECT_FALSE(found->has_proof());
  ASSERT_THAT(found->regions(), SizeIs(1));
  EXPECT_EQ(found->regions(0).region().region(), "edge");
  ASSERT_THAT(found->holding(), SizeIs(1));
  EXPECT_EQ(found->holding(0).region(), "edge");
  EXPECT_EQ(found->holding(0).limit(), v1::SHAPE_LIMIT_STOCK);
  const auto none = Get(infeasible);
  ASSERT_TRUE(none.ok()) << none.status();
  EXPECT_EQ(none->proof().lacking_um(), 12);
  EXPECT_EQ(none->proof().tolerance().at_most_um(), 14);
  EXPECT_FALSE(none->proof().has_stock());
  EXPECT_FALSE(none->has_worst_step_um());
}

TEST_F(ReconstructionHandlersTest, ListsByPagesNewestFirstAndByWhatIsAskedFor) {
  Row other = Infeasible();
  other.blade_serial = "sn2";
  const std::vector<std::string> names = {Put(), Put(other), Put(), Put(), Put()};
  testing::ExpectPagesNewestFirst<v1::ListReconstructionsRequest>(
      names, [this](const auto& request) { return List(request); },
      [](const auto& page) { return page.reconstructions(); });
  v1::ListReconstructionsRequest request;
  request.set_blade("blades/sn2");
  EXPECT_THAT(testing::ListedNames(List(request)->reconstructions()), ElementsAre(names[1]));
  request.clear_blade();
  request.set_outcome(v1::RECONSTRUCTION_OUTCOME_INFEASIBLE);
  EXPECT_THAT(testing::ListedNames(List(request)->reconstructions()), ElementsAre(names[1]));
  request.set_outcome(v1::RECONSTRUCTION_OUTCOME_NOT_DETERMINED);
  EXPECT_THAT(List(request)->reconstructions(), IsEmpty());
}

TEST_F(ReconstructionHandlersTest, AListLeavesTheHoldingPlacesOutUnlessTheWholeIsAskedFor) {
  const std::string name = Put();
  v1::ListReconstructionsRequest request;
  const auto basic = List(request);
  ASSERT_TRUE(basic.ok()) << basic.status();
  ASSERT_THAT(basic->reconstructions(), SizeIs(1));
  EXPECT_THAT(basic->reconstructions(0).holding(), IsEmpty());
  EXPECT_THAT(basic->reconstructions(0).regions(), SizeIs(1));
  request.set_view(list::v1::VIEW_FULL);
  const auto full = List(request);
  ASSERT_TRUE(full.ok()) << full.status();
  EXPECT_EQ(full->reconstructions(0).DebugString(), Get(name)->DebugString());
}

TEST_F(ReconstructionHandlersTest, AListRefusesEachFieldByItsName) {
  testing::ExpectListRefusals<v1::ListReconstructionsRequest>([this](const auto& request) { return List(request); });
  v1::ListReconstructionsRequest request;
  request.set_outcome(static_cast<v1::ReconstructionOutcome>(99));
  EXPECT_EQ(testing::RefusedField(List(request).status()), "outcome");
}

// Of messages of 10,000 at most: a blank may have a hundred times as many.
TEST_F(ReconstructionHandlersTest, PatchesAreStreamedInTheirOrder) {
  constexpr int kCount = 10'001;
  Row row = Sample();
  row.patches = {};
  for (int i = 0; i < kCount; ++i) {
    for (const int axis : {0, 1, 2}) {
      row.patches.points_in_part_mm.push_back(i + 0.25 * axis);
      row.patches.normals_in_part.push_back(axis == 2 ? 1 : 0);
    }
    row.patches.expanded_uncertainties_um.push_back(2);
    row.patches.stock_um.push_back(i % 3 == 0 ? NAN : i);
    row.patches.regions.push_back(i % 2);
  }
  const auto streamed = Patches(Put(row));
  ASSERT_TRUE(streamed.status.ok()) << streamed.status;
  ASSERT_THAT(streamed.messages, SizeIs(2));
  EXPECT_EQ(streamed.messages[0].stock_um_size(), 10'000);
  v1::BlankPatches all = streamed.messages[0];
  all.MergeFrom(streamed.messages[1]);
  ASSERT_EQ(all.stock_um_size(), kCount);
  ASSERT_EQ(all.points_in_part_mm_size(), 3 * kCount);
  ASSERT_EQ(all.normals_in_part_size(), 3 * kCount);
  ASSERT_EQ(all.expanded_uncertainties_um_size(), kCount);
  for (int i = 0; i < kCount; ++i) {
    ASSERT_EQ(all.points_in_part_mm(3 * i + 2), i + 0.5) << i;
    ASSERT_EQ(all.regions(i), i % 2) << i;
    ASSERT_EQ(std::isnan(all.stock_um(i)), i % 3 == 0) << i;
  }
}

TEST_F(ReconstructionHandlersTest, TheLatticeIsStreamedInPiecesOfAMebibyte) {
  Row row = Sample();
  row.lattice.clear();
  for (std::size_t i = 0; i < (std::size_t{5} << 19); ++i) row.lattice += static_cast<char>(i % 251);
  row.lattice_sha256 = storage::Sha256Hex(row.lattice);
  const auto streamed = Lattice(Put(row));
  ASSERT_TRUE(streamed.status.ok()) << streamed.status;
  ASSERT_THAT(streamed.messages, SizeIs(3));
  EXPECT_THAT(streamed.messages[0].lattice(), SizeIs(std::size_t{1} << 20));
  std::string whole;
  for (const v1::LatticePiece& piece : streamed.messages) whole += piece.lattice();
  EXPECT_EQ(storage::Sha256Hex(whole), row.lattice_sha256);
}

TEST_F(ReconstructionHandlersTest, WhereNoShapeWasFoundThereIsNoLattice) {
  const std::string name = Put(Infeasible());
  const auto none = Lattice(name);
  EXPECT_EQ(testing::RefusedField(none.status), "name");
  EXPECT_THAT(std::string(none.status.message()), HasSubstr("RECONSTRUCTION_OUTCOME_INFEASIBLE"));
  EXPECT_THAT(none.messages, IsEmpty());
  EXPECT_THAT(Patches(name).messages, SizeIs(1)) << "what was measured of it is there";
}

TEST_F(ReconstructionHandlersTest, WhatIsNotRecordedIsNotFoundAndOtherNamesAreRefused) {
  Put();
  const std::string name = std::string("reconstructions/") + kSomeUuid;
  for (const absl::Status& status : StatusesOf(name)) {
    EXPECT_EQ(status.code(), absl::StatusCode::kNotFound) << status;
    EXPECT_EQ(runtime::ReasonOf(status), "RECONSTRUCTION_NOT_FOUND");
    EXPECT_EQ(runtime::MetadataOf(status)["resource"], name);
  }
  for (const absl::Status& status : StatusesOf(std::string("repairs/") + kSomeUuid))
    EXPECT_EQ(testing::RefusedField(status), "name");
}

TEST_F(ReconstructionHandlersTest, SaysWhatTheStoreSays) {
  const std::string name = Put();
  store_->Fail(absl::DeadlineExceededError("database: slow"));
  std::vector<absl::Status> statuses = StatusesOf(name);
  statuses.push_back(List({}).status());
  statuses.push_back(Reconstruct(Request()).status());
  for (const absl::Status& status : statuses) EXPECT_EQ(status.code(), absl::StatusCode::kDeadlineExceeded) << status;
}

// A row of a newer release, after a step back to this one.
TEST_F(ReconstructionHandlersTest, AWordThatThisReleaseDoesNotKnowIsDataLoss) {
  Row row = Sample();
  row.outcome = "ALMOST";
  EXPECT_EQ(Get(Put(row)).status().code(), absl::StatusCode::kDataLoss);
  row = Sample();
  row.regions.front().applied.kind = "POLISHED";
  EXPECT_EQ(Get(Put(row)).status().code(), absl::StatusCode::kDataLoss);
}

TEST_F(ReconstructionHandlersTest, ARetryGetsWhatTheFirstCallRecordedWithoutAnyWork) {
  const std::string name = Put(Sample(), Request(kSomeUuid));
  const auto again = Reconstruct(Request(kSomeUuid));  // the part has no shape_regions: work would fail
  ASSERT_TRUE(again.ok()) << again.status();
  EXPECT_EQ(again->DebugString(), Get(name)->DebugString());
  EXPECT_THAT(store_->rows(), SizeIs(1));
  v1::ReconstructRequest other = Request(kSomeUuid);
  other.mutable_method()->set_patch_mm(1);
  EXPECT_EQ(Reconstruct(other).status().code(), absl::StatusCode::kAlreadyExists);
}

TEST_F(ReconstructionHandlersTest, NothingIsRecordedOfWhatIsRefused) {
  v1::ReconstructRequest request = Request();
  request.set_registration("scans/s0");
  EXPECT_EQ(testing::RefusedField(Reconstruct(request).status()), "registration");
  request = Request();
  request.mutable_method()->set_patch_mm(0.05);
  EXPECT_EQ(testing::RefusedField(Reconstruct(request).status()), "method.patch_mm");
  EXPECT_EQ(testing::RefusedField(Reconstruct(Request()).status()), "registration.part") << "without shape_regions";
  plant::v1::ShapeRegion& all = *plant_.plant.part.add_shape_regions();
  all.set_region("all");
  all.set_rest(true);
  all.set_kind(plant::v1::SHAPE_REGION_KIND_DATUM);
  request = Request();
  request.add_tried_limits()->set_region("edge");
  request.mutable_tried_limits(0)->set_upper_mm(0.1);
  EXPECT_EQ(testing::RefusedField(Reconstruct(request).status()), "tried_limits[0].region");
  request.mutable_tried_limits(0)->set_region("all");
  EXPECT_EQ(testing::RefusedField(Reconstruct(request).status()), "tried_limits[0].upper_mm") << "of a datum";
  plant_.registration.registration.mutable_evidence()->set_outcome(registration::v1::OUTCOME_NOT_CONVERGED);
  EXPECT_EQ(runtime::ReasonOf(Reconstruct(Request()).status()), "REGISTRATION_NOT_CONVERGED");
  EXPECT_THAT(plant_.ingest.downloads(), IsEmpty());
  EXPECT_THAT(store_->rows(), IsEmpty());
  EXPECT_THAT(store_->entries(), IsEmpty());
}

}  // namespace
}  // namespace sixpoint::correction
