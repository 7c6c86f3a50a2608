// Hostile CAD breaks a worker process at most.
#include "services/plant/cad_worker.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <sstream>

#include "metrology/mesh/mesh_bytes.h"
#include "metrology/mesh/triangle_mesh.h"
#include "metrology/mesh/volume.h"
#include "sandbox/confine.h"
#include "tests/metrology/cad/sample_cad.h"
#include "tests/sandbox/denied_call.h"

namespace sixpoint::plant {
namespace {

using ::testing::HasSubstr;
using testing::SampleShape;

bool Always() { return true; }

CadWorkerOptions WorkerOptions() {
  const char* folder = std::getenv("SIXPOINT_BIN_DIR");
  CadWorkerOptions options;
  options.program = std::string(folder == nullptr ? "." : folder) + "/sixpoint-cad-worker";
  return options;
}

const CadFile kStep{"step", 1, 4};

std::string MessageOf(const absl::StatusOr<std::string>& mesh) { return std::string(mesh.status().message()); }

TEST(CadWorker, GivesTheMeshOfAPart) {
  const auto bytes = TessellateInWorker(WorkerOptions(), kStep, testing::StepOf(SampleShape::kCylinder), Always);
  ASSERT_TRUE(bytes.ok()) << bytes.status();
  const auto mesh = metrology::MeshFromBytes(*bytes);
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  EXPECT_NEAR(metrology::SignedVolume(*mesh), 1570.796, 4);  // pi 5^2 20, 4 um over 785 mm2
}

// OpenCASCADE asks the system for the user's name when it reads IGES; the worker has no name service to ask.
TEST(CadWorker, ReadsIgesBehindItsFilter) {
  const CadFile iges{"iges", 1, 4};
  const auto bytes = TessellateInWorker(WorkerOptions(), iges, testing::IgesOf(SampleShape::kTorus), Always);
  ASSERT_TRUE(bytes.ok()) << bytes.status();
  const auto mesh = metrology::MeshFromBytes(*bytes);
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  EXPECT_NEAR(std::abs(metrology::SignedVolume(*mesh)), 2 * M_PI * M_PI * 10 * 9, 10);  // 4 um over 1184 mm2, both ways
}

TEST(CadWorker, ReadsStlBehindItsFilter) {
  std::string stl = "solid corner\n";
  for (const char* facet : {"0 0 0 0 1 0 1 0 0", "0 0 0 1 0 0 0 0 1", "0 0 0 0 0 1 0 1 0", "1 0 0 0 1 0 0 0 1"}) {
    std::istringstream corners(facet);
    stl += "facet normal 0 0 0\nouter loop\n";
    for (std::string x, y, z; corners >> x >> y >> z;) stl += "vertex " + x + " " + y + " " + z + "\n";
    stl += "endloop\nendfacet\n";
  }
  const auto bytes = TessellateInWorker(WorkerOptions(), {"stl", 2, 1}, stl + "endsolid corner\n", Always);
  ASSERT_TRUE(bytes.ok()) << bytes.status();
  const auto mesh = metrology::MeshFromBytes(*bytes);
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  EXPECT_NEAR(metrology::SignedVolume(*mesh), 8.0 / 6, 1e-12);
}

TEST(CadWorker, PassesTheReasonOfARefusalOn) {
  const CadWorkerOptions options = WorkerOptions();
  EXPECT_THAT(MessageOf(TessellateInWorker(options, kStep, "not a STEP file", Always)),
              HasSubstr("cad.content: unreadable, want a STEP file"));
  EXPECT_THAT(MessageOf(TessellateInWorker(options, kStep, testing::StepOf(SampleShape::kHugeBox), Always)),
              HasSubstr("cad.extent_mm: 20000"));
  EXPECT_THAT(MessageOf(TessellateInWorker(options, {"stl", 1, 1}, "solid x\nfacet", Always)),
              HasSubstr("stl.facets[0]"));
}

TEST(CadWorker, EndsWithItsTime) {
  CadWorkerOptions hasty = WorkerOptions();
  hasty.patience = std::chrono::milliseconds(1);
  EXPECT_THAT(MessageOf(TessellateInWorker(hasty, kStep, testing::StepOf(SampleShape::kTorus), Always)),
              HasSubstr("still unread after its time"));
}

TEST(CadWorker, EndsWithItsMemory) {
  if (!sandbox::kApplied) GTEST_SKIP() << "sanitizers reserve terabytes of address space";
  CadWorkerOptions poor = WorkerOptions();
  poor.memory_mb = 150;  // hardly more than its libraries
  const auto mesh = TessellateInWorker(poor, {"step", 1, 0.05}, testing::StepOf(SampleShape::kTorus), Always);
  EXPECT_EQ(mesh.status().code(), absl::StatusCode::kInvalidArgument);
}

TEST(CadWorker, EndsWithItsCaller) {
  int asked_count = 0;
  const auto mesh = TessellateInWorker(WorkerOptions(), {"step", 1, 0.05}, testing::StepOf(SampleShape::kTorus),
                                       [&] { return ++asked_count < 3; });
  EXPECT_EQ(mesh.status().code(), absl::StatusCode::kCancelled);
}

TEST(CadWorker, IsMissedClearly) {
  CadWorkerOptions options = WorkerOptions();
  options.program += "-of-another-name";
  EXPECT_EQ(TessellateInWorker(options, kStep, "x", Always).status().code(), absl::StatusCode::kUnavailable);
}

TEST(CadWorker, SaysWhyItCannotConfineItself) {
  if (!sandbox::kApplied) GTEST_SKIP() << "sanitizers make calls of their own: workers are not confined under one";
  EXPECT_EXIT(
      {
        testing::DenyCall("seccomp", EPERM);
        const auto mesh = TessellateInWorker(WorkerOptions(), kStep, testing::StepOf(SampleShape::kBox), Always);
        std::fprintf(stderr, "%s\n", mesh.status().ToString().c_str());
        _exit(absl::IsUnavailable(mesh.status()) ? 0 : 1);
      },
      ::testing::ExitedWithCode(0), "cannot confine itself: filter of system calls: Operation not permitted");
}

std::string RealVane() {
  const char* shared = std::getenv("SIXPOINT_SHARED_DIR");
  std::ifstream file(std::string(shared == nullptr ? "" : shared) + "/data/plant-a/cad.step", std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

// Damage of the kinds that break parsers: lost lines, other references, other numbers, cut ends.
std::string Damaged(std::string cad, std::mt19937* random) {
  const auto at = [&] { return (*random)() % cad.size(); };
  switch ((*random)() % 5) {
    case 0:
      cad.resize(at());
      break;
    case 1:
      for (int i = 0; i < 20; ++i) cad[at()] = static_cast<char>((*random)());
      break;
    case 2:  // digits only: references to other entities, other counts and coordinates
      for (int i = 0; i < 200; ++i) {
        char& character = cad[at()];
        if (character >= '0' && character <= '9') character = static_cast<char>('0' + (*random)() % 10);
      }
      break;
    case 3:
      for (int i = 0; i < 5; ++i) cad.erase(at(), (*random)() % 400);
      break;
    default: {
      const std::string piece = cad.substr(at(), (*random)() % 2000);
      for (int i = 0; i < 5; ++i) cad.insert(at(), piece);
    }
  }
  return cad;
}

TEST(CadWorker, MutantsOfCadNeverReachTheCaller) {
  const std::string vane = RealVane();
  CadWorkerOptions options = WorkerOptions();
  options.cpu_s = 5;  // a mutant may loop
  options.patience = std::chrono::seconds(10);
  std::mt19937 random(7);
  int refused_count = 0;
  const int trial_count = 40;
  for (int trial = 0; trial < trial_count; ++trial) {
    const bool real = !vane.empty() && trial % 4 == 0;  // the large file now and then: time
    const std::string cad = Damaged(real ? vane : testing::StepOf(SampleShape::kTorus), &random);
    const auto bytes = TessellateInWorker(options, {"step", 1, 50}, cad, Always);
    if (!bytes.ok()) {
      ASSERT_EQ(bytes.status().code(), absl::StatusCode::kInvalidArgument) << bytes.status();
      ++refused_count;
    } else {
      ASSERT_TRUE(metrology::MeshFromBytes(*bytes).ok());
    }
  }
  EXPECT_GT(refused_count, trial_count / 5);
}

// An entity that is made of itself sends a recursive reader down its stack.
TEST(CadWorker, ACycleOfReferencesIsRefused) {
  const std::string cad =
      "ISO-10303-21;\nHEADER;\nFILE_DESCRIPTION((''),'2;1');\nFILE_NAME('','',(''),(''),'','','');\n"
      "FILE_SCHEMA(('AUTOMOTIVE_DESIGN { 1 0 10303 214 1 1 1 1 }'));\nENDSEC;\nDATA;\n"
      "#1=ORIENTED_EDGE('',*,*,#1,.T.);\n#2=EDGE_LOOP('',(#1));\n#3=FACE_BOUND('',#2,.T.);\n"
      "#4=ADVANCED_FACE('',(#3),#5,.T.);\n#5=PLANE('',#6);\n#6=AXIS2_PLACEMENT_3D('',#7,$,$);\n"
      "#7=CARTESIAN_POINT('',(0.,0.,0.));\n#8=CLOSED_SHELL('',(#4));\n#9=MANIFOLD_SOLID_BREP('',#8);\n"
      "#10=ADVANCED_BREP_SHAPE_REPRESENTATION('',(#9),#11);\n"
      "#11=(GEOMETRIC_REPRESENTATION_CONTEXT(3)REPRESENTATION_CONTEXT('',''));\nENDSEC;\nEND-ISO-10303-21;\n";
  EXPECT_EQ(TessellateInWorker(WorkerOptions(), kStep, cad, Always).status().code(),
            absl::StatusCode::kInvalidArgument);
}

}  // namespace
}  // namespace sixpoint::plant
