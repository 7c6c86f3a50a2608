// Drawings as people write them, and their commands against a service that only remembers.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>

#include "cli/document.h"
#include "cli/drawing_document.h"
#include "sixpoint/plant/v1/drawing.grpc.pb.h"
#include "tests/cli/command_run.h"
#include "tests/cli/example.h"
#include "tests/support/in_process_server.h"

namespace sixpoint::cli {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

struct FakeDrawings final : plant::v1::DrawingService::Service {
  plant::v1::CreateDrawingRequest created;
  std::string got, part;
  grpc::Status CreateDrawing(grpc::ServerContext*, const plant::v1::CreateDrawingRequest* in,
                             plant::v1::Drawing* out) override {
    created = *in;
    *out = in->drawing();
    out->set_name("drawings/" + in->drawing_id());
    out->set_revision(4);
    out->set_requested_by("users/jane");
    return grpc::Status::OK;
  }
  grpc::Status GetDrawing(grpc::ServerContext*, const plant::v1::GetDrawingRequest* in,
                          plant::v1::Drawing* out) override {
    got = in->name();
    *out = created.drawing();
    return grpc::Status::OK;
  }
  grpc::Status ListDrawings(grpc::ServerContext*, const plant::v1::ListDrawingsRequest* in,
                            plant::v1::ListDrawingsResponse* out) override {
    part = in->part();
    plant::v1::Drawing& one = *out->add_drawings();
    one.set_name("drawings/block-1");
    one.set_characteristic_count(7);
    return grpc::Status::OK;
  }
};

class DrawingCommands : public ::testing::Test {
 protected:
  DrawingCommands() { std::filesystem::create_directories(folder_); }
  ~DrawingCommands() override { std::filesystem::remove_all(folder_); }
  Ended Run(const std::string& words) const {
    return RunCommand(words + " --server " + server_.address(),
                      [](Session* session) { session->credentials = grpc::InsecureChannelCredentials(); });
  }
  // The example with `from` written as `to`.
  std::string Changed(const std::string& from, const std::string& to) const {
    std::string text = *ReadFile(Example("drawing.yaml"), kGreatestDocumentBytes);
    const std::size_t at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    EXPECT_TRUE(WriteFile(folder_ + "/drawing.yaml", text.replace(at, from.size(), to)).ok());
    return folder_ + "/drawing.yaml";
  }
  const std::string folder_ = ::testing::TempDir() + "/drawing";
  FakeDrawings drawings_;
  testing::InProcessServer server_{{&drawings_}};
};

TEST_F(DrawingCommands, TheDrawingOfTheDocsIsRead) {
  const auto request = LoadDrawing(Example("drawing.yaml"));
  ASSERT_TRUE(request.ok()) << request.status();
  EXPECT_EQ(request->drawing_id(), "block-1");
  const plant::v1::Drawing& drawing = request->drawing();
  EXPECT_EQ(drawing.part(), "parts/block-1");
  EXPECT_THAT(drawing.part_revisions(), ElementsAre(1));
  EXPECT_EQ(drawing.drawing_revision(), "C");
  EXPECT_EQ(drawing.decision_rule().edition(), "2017");
  ASSERT_EQ(drawing.datum_systems_size(), 1);
  EXPECT_EQ(drawing.datum_systems(0).positioning(), plant::v1::DATUM_POSITIONING_SIX_POINT_NORMALS);
  EXPECT_THAT(drawing.datum_systems(0).datums(1).datum_points(), ElementsAre("D4", "D5"));
  ASSERT_EQ(drawing.characteristics_size(), 7);
  const plant::v1::Characteristic& position = drawing.characteristics(0);
  EXPECT_EQ(position.quantity(), plant::v1::CHARACTERISTIC_QUANTITY_HOLE_POSITION);
  EXPECT_EQ(position.characteristic_class(), plant::v1::CHARACTERISTIC_CLASS_CRITICAL);
  EXPECT_EQ(position.zone(), plant::v1::TOLERANCE_ZONE_DIAMETER);
  EXPECT_FALSE(position.has_lower_limit());
  EXPECT_EQ(position.upper_limit(), 0.06);
  EXPECT_EQ(drawing.characteristics(5).decision_rule().guard_factor(), 0.5);
  EXPECT_EQ(drawing.product_requirements_size(), 2);
}

TEST_F(DrawingCommands, AFileSaysWhereItIsOdd) {
  const auto refusal = [this](const std::string& from, const std::string& to) {
    return std::string(LoadDrawing(Changed(from, to)).status().message());
  };
  EXPECT_THAT(refusal("    unit: mm\n", ""), HasSubstr("characteristics[0].unit"));
  EXPECT_THAT(refusal("unit: mm", "unit: inch"), HasSubstr("one of mm, um, deg, ratio"));
  EXPECT_THAT(refusal("upper_limit: 0.06", "uper_limit: 0.06"), HasSubstr("characteristics[0].uper_limit"));
  EXPECT_THAT(refusal("characteristic: \"1\"", "characteristic: 1"),
              HasSubstr("in quotes where it looks like a number"));
  EXPECT_THAT(refusal("class: critical", "class: key"), HasSubstr("one of minor, major, critical"));
  EXPECT_THAT(refusal("part_revisions: [1]", "part_revisions: [0]"), HasSubstr("part_revisions[0]"));
  EXPECT_THAT(refusal("upper_limit: 0.06", "upper_limit: .nan"), HasSubstr("characteristics[0].upper_limit"));
}

TEST_F(DrawingCommands, ADrawingIsAddedAndShown) {
  const Ended added = Run("drawing add " + Example("drawing.yaml"));
  EXPECT_EQ(added.exit_code, kDone) << added.err;
  EXPECT_THAT(added.out, AllOf(HasSubstr("drawings/block-1, revision 4"), HasSubstr("by users/jane"),
                               HasSubstr("70-1184-01, revision C, with ECN 2231"),
                               HasSubstr("valid    for parts/block-1@1"), HasSubstr("judged   by ISO 14253-1:2017"),
                               HasSubstr("A|B|C by six-point-normals, A: D1 D2 D3, B: D4 D5, C: D6")));
  EXPECT_THAT(added.out,
              AllOf(HasSubstr("G1/H1 to H2"), HasSubstr("section-chord, caliper"), HasSubstr("guard-factor 0.5"),
                    HasSubstr("sheet 1, zone C4"), HasSubstr("position, diameter 0.06, A|B|C")));
  EXPECT_FALSE(drawings_.created.request_id().empty());
  EXPECT_FALSE(drawings_.created.has_revises());
  Run("drawing add " + Example("drawing.yaml") + " --revises 3");
  EXPECT_EQ(drawings_.created.revises(), 3);
  EXPECT_THAT(Run("drawing add " + Example("drawing.yaml") + " --revises -1").err, HasSubstr("--revises"));
  EXPECT_EQ(Run("drawing show block-1@2 --json").json()["characteristics"].size(), 7u);
  EXPECT_EQ(drawings_.got, "drawings/block-1@2");
}

TEST_F(DrawingCommands, DrawingsAreListed) {
  EXPECT_THAT(Run("drawing list --part block-1").out, AllOf(HasSubstr("block-1"), HasSubstr("7")));
  EXPECT_EQ(drawings_.part, "parts/block-1");
  EXPECT_EQ(Run("drawing list --json").json().size(), 1u);
}

}  // namespace
}  // namespace sixpoint::cli
