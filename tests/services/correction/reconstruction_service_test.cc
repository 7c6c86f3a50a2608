// Shapes for a scanned blank whose edge lacks stock: kept and read back, judged by the blank as it truly is; that there is none, with its proof.
#include "services/correction/reconstruction_service.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "metrology/cloud/draco_codec.h"
#include "metrology/mesh/mesh_bytes.h"
#include "services/clients/scan_blocks.h"
#include "services/correction/lattice_bytes.h"
#include "services/correction/reconstruction_order.h"
#include "services/runtime/call.h"
#include "services/runtime/errors.h"
#include "storage/blobs.h"
#include "tests/metrology/reconstruction/blank_worlds.h"
#include "tests/services/correction/blank_plant.h"
#include "tests/support/sanitizer.h"

namespace sixpoint::correction {
namespace {

using Eigen::Vector3d;
using metrology::BlankPatch;
using testing::BlankPlant;
using testing::BlankPoint;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using testing::kAllowance_mm;
using testing::kEdge_mm;

class ReconstructionServiceTest : public ::testing::Test {
 protected:
  absl::StatusOr<v1::Reconstruction> Make(const v1::ReconstructRequest& request) {
    v1::Reconstruction made;
    const grpc::Status status =
        stub_->Reconstruct(runtime::ContextFor(sixpoint::testing::kPatience * 120).get(), request, &made);
    if (!status.ok()) return runtime::FromGrpc(status);
    return made;
  }
  static v1::ReconstructRequest Request() {
    v1::ReconstructRequest request;
    request.set_registration(testing::kRegistration);
    return request;
  }
  absl::StatusOr<std::string> Lattice(const std::string& name) {
    v1::DownloadLatticeRequest request;
    request.set_name(name);
    const auto context = runtime::ContextFor(10);
    const auto reader = stub_->DownloadLattice(context.get(), request);
    std::string bytes;
    for (v1::LatticePiece piece; reader->Read(&piece);) bytes += piece.lattice();
    if (const grpc::Status status = reader->Finish(); !status.ok()) return runtime::FromGrpc(status);
    return bytes;
  }
  std::int64_t Count(const std::string& table) {
    auto transaction = plant_.database.database()->Begin(testing::Soon());
    return transaction->Execute("SELECT count(*) FROM " + table)->Int(0, 0);
  }

  BlankPlant plant_{0.4};
  ReconstructionService service_{storage::ReconstructionsIn(plant_.database.database()),
                                 std::make_shared<const clients::BladePeers>(plant_.Connect(), plant_.Connect(),
                                                                             plant_.Connect(), plant_.Connect()),
                                 {1, 4},
                                 2};
  testing::InProcessServer server_{{&service_}};
  std::unique_ptr<v1::ReconstructionService::Stub> stub_ = v1::ReconstructionService::NewStub(server_.Connect());
};

TEST_F(ReconstructionServiceTest, MovesTheEdgeIntoTheBlankAndReadsBackTheSame) {
  v1::ReconstructRequest request = Request();
  request.set_request_id("018f6f3e-7c1a-7e5b-9d5a-2f1c3b4a5d6e");
  const auto made = Make(request);
  ASSERT_TRUE(made.ok()) << made.status();
  ASSERT_EQ(made->outcome(), v1::RECONSTRUCTION_OUTCOME_RECONSTRUCTED) << made->DebugString();
  EXPECT_TRUE(made->of_part_limits());
  ASSERT_EQ(made->regions_size(), 3);
  // Beside what is fixed nothing is cut and no stock is wanted: what lacks there is noise.
  EXPECT_GT(made->regions(0).least_allowance_um(), -1);
  EXPECT_GT(made->regions(0).least_spare_um(), -1);
  EXPECT_GT(made->regions(0).greatest_band_use(), 0.3);
  EXPECT_FALSE(made->regions(0).has_worst_fixed_um());
  EXPECT_LT(made->regions(1).worst_datum_um(), 1.5);
  EXPECT_LT(made->regions(2).worst_fixed_um(), 8);
  EXPECT_THAT(made->holding(), ::testing::Not(IsEmpty()));
  EXPECT_FALSE(made->has_proof());
  EXPECT_EQ(made->method().patch_mm(), 0.5);

  v1::GetReconstructionRequest get;
  get.set_name(made->name());
  v1::Reconstruction back;
  ASSERT_TRUE(stub_->GetReconstruction(runtime::ContextFor(10).get(), get, &back).ok());
  EXPECT_EQ(back.DebugString(), made->DebugString());
  const auto again = Make(request);
  ASSERT_TRUE(again.ok()) << again.status();
  EXPECT_EQ(again->name(), made->name());
  EXPECT_EQ(Count("reconstructions"), 1);

  v1::ListReconstructionsRequest list;
  list.set_blade("blades/sn1");
  list.set_outcome(v1::RECONSTRUCTION_OUTCOME_RECONSTRUCTED);
  v1::ListReconstructionsResponse listed;
  ASSERT_TRUE(stub_->ListReconstructions(runtime::ContextFor(10).get(), list, &listed).ok());
  ASSERT_EQ(listed.reconstructions_size(), 1);
  EXPECT_THAT(listed.reconstructions(0).holding(), IsEmpty());  // the basic view
  list.set_outcome(v1::RECONSTRUCTION_OUTCOME_INFEASIBLE);
  ASSERT_TRUE(stub_->ListReconstructions(runtime::ContextFor(10).get(), list, &listed).ok());
  EXPECT_THAT(listed.reconstructions(), IsEmpty());

  auto transaction = plant_.database.database()->Begin(testing::Soon());
  const auto derived = storage::DerivedFrom(*transaction, plant_.scans[2]);
  ASSERT_TRUE(derived.ok());
  std::vector<std::string> names;
  for (const storage::JournalEntry& journal : *derived) names.push_back(journal.entry.name);
  EXPECT_THAT(names, Contains(made->name()));
}

// The lattice as it comes over the wire, beside the blank as it truly is: what no scan and no limit of the service knows.
TEST_F(ReconstructionServiceTest, TheShapeLiesInsideTheTrueBlank) {
  const auto made = Make(Request());
  ASSERT_TRUE(made.ok()) << made.status();
  const auto bytes = Lattice(made->name());
  ASSERT_TRUE(bytes.ok()) << bytes.status();
  EXPECT_EQ(storage::Sha256Hex(*bytes), made->lattice_sha256());
  const auto deformation = DeformationOf(*bytes);
  ASSERT_TRUE(deformation.ok()) << deformation.status();
  const auto shape = testing::MovedSurface(*plant_.design, *deformation);
  double least_mm = 1, fixed_mm = 0;
  for (std::size_t i = 0; i < plant_.truth.size(); i += 7) {
    const BlankPoint& point = plant_.truth[i];
    const double distance_mm = shape->Closest(point.point_mm).signed_distance_mm;
    // Deep in the edge all of the allowance is wanted; what looks along the chord no scan saw.
    if (point.place_mm.x() > kEdge_mm + 3.5 && point.place_mm.z() > -1 && std::abs(point.outward.x()) < 0.9)
      least_mm = std::min(least_mm, distance_mm);
    if (point.place_mm.x() < kEdge_mm - 1 && point.place_mm.z() > -8 && std::abs(point.outward.y()) > 0.3)
      fixed_mm = std::max(fixed_mm, std::abs(distance_mm));
  }
  EXPECT_GT(least_mm, kAllowance_mm - 1e-3);
  EXPECT_LT(fixed_mm, 0.006);

  v1::DownloadBlankPatchesRequest request;
  request.set_name(made->name());
  const auto context = runtime::ContextFor(10);
  const auto reader = stub_->DownloadBlankPatches(context.get(), request);
  v1::BlankPatches all;
  for (v1::BlankPatches some; reader->Read(&some);) all.MergeFrom(some);
  ASSERT_TRUE(reader->Finish().ok());
  ASSERT_EQ(all.stock_um_size(), made->patch_count());
  ASSERT_EQ(all.points_in_part_mm_size(), 3 * made->patch_count());
  double least_um = 1e9;
  for (int i = 0; i < all.stock_um_size(); ++i)
    if (all.regions(i) == 0 && std::isfinite(all.stock_um(i))) least_um = std::min<double>(least_um, all.stock_um(i));
  EXPECT_NEAR(least_um, made->regions(0).least_allowance_um(), 0.01);
}

TEST_F(ReconstructionServiceTest, WithTooNarrowABandThereIsNoneAndTheProofSaysWhatWouldCure) {
  v1::ReconstructRequest request = Request();
  v1::TriedLimits& tried = *request.add_tried_limits();
  tried.set_region("leading edge");
  tried.set_lower_mm(-0.1);
  const auto made = Make(request);
  ASSERT_TRUE(made.ok()) << made.status();
  ASSERT_EQ(made->outcome(), v1::RECONSTRUCTION_OUTCOME_INFEASIBLE) << made->DebugString();
  EXPECT_FALSE(made->of_part_limits());
  EXPECT_FALSE(made->remark().empty());
  ASSERT_TRUE(made->has_proof());
  EXPECT_GT(made->proof().lacking_um(), 0);
  ASSERT_TRUE(made->proof().has_tolerance());
  EXPECT_GT(made->proof().tolerance().at_least_um(), 50);
  EXPECT_LE(made->proof().tolerance().at_least_um(), made->proof().tolerance().at_most_um());
  EXPECT_THAT(made->holding(), ::testing::Not(IsEmpty()));
  EXPECT_FALSE(made->has_worst_step_um());
  EXPECT_TRUE(made->lattice_sha256().empty());
  EXPECT_THAT(Lattice(made->name()).status().message(), HasSubstr("INFEASIBLE"));
  EXPECT_EQ(Count("reconstructions"), 1);
}

TEST_F(ReconstructionServiceTest, RefusesWhatItCannotKeepAndWritesNothing) {
  const auto message = [this](const v1::ReconstructRequest& request) {
    const auto made = Make(request);
    EXPECT_EQ(made.status().code(), absl::StatusCode::kInvalidArgument) << made.status();
    return std::string(made.status().message());
  };
  v1::ReconstructRequest request = Request();
  request.mutable_method()->set_patch_mm(0.01);
  request.mutable_method()->set_coarsest_spacing_mm(1);
  EXPECT_THAT(message(request), ::testing::AllOf(HasSubstr("method.patch_mm"), HasSubstr("coarsest_spacing_mm")));
  request = Request();
  request.mutable_method()->set_finest_spacing_mm(0.5);
  v1::TriedLimits& tried = *request.add_tried_limits();
  tried.set_region("trailing edge");
  tried.set_allowance_mm(0.1);
  EXPECT_THAT(message(request), HasSubstr("tried_limits[0].region: trailing edge"));
  request.mutable_tried_limits(0)->set_region("body");
  EXPECT_THAT(message(request), HasSubstr("tried_limits[0].allowance_mm"));
  request.mutable_tried_limits(0)->set_region("leading edge");
  request.mutable_tried_limits(0)->set_lower_mm(2);
  EXPECT_THAT(message(request), HasSubstr("less than upper_mm, 0.9"));
  *request.add_tried_limits() = request.tried_limits(0);
  EXPECT_THAT(message(request), HasSubstr("each region once"));

  plant_.ingest.scans[plant_.scans[3]].mutable_header()->set_kind(ingest::v1::SCAN_KIND_PINS);
  EXPECT_THAT(message(Request()), HasSubstr("registration.scans[3]: a scan with pins"));
  plant_.plant.part.mutable_shape_regions()->RemoveLast();
  EXPECT_THAT(message(Request()), HasSubstr("part.shape_regions"));  // places in none
  plant_.plant.part.clear_shape_regions();
  EXPECT_THAT(message(Request()), HasSubstr("parts/p1@1 has no shape_regions"));
  EXPECT_EQ(Count("reconstructions"), 0);
}

TEST(LatticeBytes, ReadBackAsTheyWereAndNeverAsSomethingElse) {
  metrology::ControlLattice lattice;
  lattice.cells = {2, 3, 1};
  lattice.spacing_mm = {2, 2.5, 3};
  metrology::ControlDisplacements controls(3, static_cast<Eigen::Index>(lattice.control_count()));
  for (Eigen::Index i = 0; i < controls.size(); ++i) controls.data()[i] = 1e-3 * static_cast<double>(i % 17) - 5e-3;
  std::vector<std::uint8_t> covered(lattice.cell_count(), 1);
  covered[4] = 0;
  const std::string bytes = LatticeBytes(*metrology::FreeFormDeformation::Make(lattice, controls, covered));
  const auto back = DeformationOf(bytes);
  ASSERT_TRUE(back.ok()) << back.status();
  EXPECT_EQ(LatticeBytes(*back), bytes);
  EXPECT_EQ(*back->DisplacementAt({1, 2, 0.5}),
            *metrology::FreeFormDeformation::Make(lattice, controls, covered)->DisplacementAt({1, 2, 0.5}));
  for (std::size_t cut = 0; cut < bytes.size(); cut += 7)
    EXPECT_EQ(DeformationOf(bytes.substr(0, cut)).status().code(), absl::StatusCode::kDataLoss) << cut;
  EXPECT_FALSE(DeformationOf(bytes + "x").ok());
  std::string huge = bytes;
  huge[19 + 48] = huge[19 + 52] = huge[19 + 56] = '\xff';
  EXPECT_FALSE(DeformationOf(huge).ok());
}

TEST(LatticeSize, TooFineALatticeIsRefusedBeforeAnythingIsMadeOfIt) {
  EXPECT_TRUE(CheckLatticeSize(Vector3d(0, 0, 0), Vector3d(60, 30, 100), 3, 2).ok());
  const absl::Status refused = CheckLatticeSize(Vector3d(0, 0, 0), Vector3d(60, 30, 100), 3, 0.5);
  EXPECT_EQ(refused.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(refused.message(), HasSubstr("method.finest_spacing_mm"));
}

}  // namespace
}  // namespace sixpoint::correction
