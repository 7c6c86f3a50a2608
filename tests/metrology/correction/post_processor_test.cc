// Templates that post-processors write: what stands in them, for controls that want their programs otherwise; moved onto holes, read back,
// proven and divided as any other; and what a control with a transformation of its own makes of directions, found by a search that knows nothing
// of how they were written.
#include "metrology/correction/post_processor.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <random>
#include <regex>
#include <sstream>

#include "metrology/correction/nc_program.h"
#include "metrology/correction/nc_proof.h"
#include "metrology/correction/nc_remaining.h"
#include "metrology/frames/angles.h"
#include "tests/metrology/correction/changed_text.h"

namespace sixpoint::metrology {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

// Two holes, then a path of four poses.
std::vector<PostOperation> Operations() {
  PostOperation drill{"OP10", 3, 20.5, 0.4, 60, {{"G1", "H1", 6}, {"G1", "H2", 6.25}}, {}};
  PostOperation shape{"OP20", 4, 5, 0.4, 60, {}, {{"F1", 4}}};
  return {drill, shape};
}
std::map<std::string, NcTarget> TargetsOfPost() {
  std::map<std::string, NcTarget> targets = {{"G1/H1", {10.1234, 5.2345, -12.4321, 1.9123, -40.2468}},
                                             {"G1/H2", {-3.5234, 8.1345, -20.1321, 1.9123, -40.2468}}};
  for (int k = 1; k <= 4; ++k)
    targets["F1/" + std::to_string(k)] = {
        20.1234 + 0.5 * k, 4.2345 + 0.1 * k, -11.4321 - 0.05 * k, 22.9123 + 1.5 * k, -38.2468 - 0.7 * k, "F1", k};
  return targets;
}

PostProcessor Plain() {
  PostProcessor post;
  post.program_start = "%\nG21 G90 G0 Z100";
  post.operation_start = "(operation {operation}, electrode {diameter} by {length})\nT{tool} M6\nG0 Z50";
  post.hole = "G0 G90 {a} {b}\nG0 {x} {y}\nG1 {z} F{feed}\nG91 Z-{depth}\nG90 G0 Z50";
  post.path_start = "G0 G90 {a} {b}\nG0 {x} {y}\nG1 {z} F{feed}";
  post.path_pose = "G1 {x} {y} {z} {a} {b} F{feed}";
  post.path_end = "G0 Z50";
  post.program_end = "G0 Z100\nM30\n%";
  return post;
}

// A control that knows directions, calls its axes otherwise and numbers its blocks.
PostProcessor WithDirections() {
  PostProcessor post = Plain();
  post.axis_words = {"X", "Y", "Z", "C1", "B"};
  post.directions = post.semicolon_comments = true;
  post.direction_decimals = 8;
  post.number_step = 10;
  post.first_number = 10;
  post.program_start = "; written by a post-processor\nG71 G90 G0 Z100";
  post.operation_start = "T{tool} M6\nG0 Z50";
  post.path_start = Plain().path_start + "\nTRAORI(1)\nORIWKS ORIVECT";
  post.path_pose = "G1 {x} {y} {z} {v} F{feed}";
  post.path_end = "TRAFOOF\nG0 Z50";
  post.program_end = "M30";
  return post;
}

// As a machine's record has them: neither square to each other nor meeting, as machines are built.
RotaryAxes OfRecord() {
  RotaryAxes axes;
  axes.a = {Eigen::Vector3d(0.003, 1, -0.002).normalized(), {12, -3, -140}};
  axes.b = {Eigen::Vector3d(1, 0.001, 0.004).normalized(), {2, 31, -95}};
  return axes;
}

NcFrame FrameOf(const PostProcessor& post) {
  NcFrame frame;
  frame.axis_words = post.axis_words;
  if (post.directions) frame.transformation = OfRecord();
  return frame;
}

std::string Template(const PostProcessor& post) {
  const absl::Status may = CheckPostProcessor(post);
  EXPECT_TRUE(may.ok()) << may;
  const auto written = WriteTemplate(post, Operations(), 1 << 20);
  EXPECT_TRUE(written.ok()) << written.status();
  return written.ok() ? *written : "";
}
std::string Program(const PostProcessor& post, const std::map<std::string, NcTarget>& targets = TargetsOfPost()) {
  const auto program = ReplaceCoordinates(Template(post), targets, {'A', 'B'}, FrameOf(post));
  EXPECT_TRUE(program.ok()) << program.status() << "\n" << Template(post);
  return program.ok() ? *program : "";
}
// By axes that the record does not know: what the control does with its own is compared where the blade stands.
std::string ProvenPost(const PostProcessor& post, const std::string& program,
                       const std::map<std::string, NcTarget>& targets = TargetsOfPost()) {
  const auto moves = ReadNcProgram(program, {'A', 'B'}, FrameOf(post));
  if (!moves.ok()) return "not read: " + std::string(moves.status().message());
  const auto proof = ProveProgram(*moves, targets, RotaryAxes());
  return proof.ok() ? "proven" : "not proven: " + std::string(proof.status().message());
}
TEST(PostProcessor, WritesWhatItsSectionsSay) {
  EXPECT_EQ(Template(Plain()).substr(0, Template(Plain()).find("(SIXPOINT G1/H2)")),
            "%\nG21 G90 G0 Z100\n"
            "(operation OP10, electrode 0.4 by 60)\nT3 M6\nG0 Z50\n"
            "G0 G90 A0.0000 B0.0000 (SIXPOINT G1/H1)\nG0 X0.0000 Y0.0000 (SIXPOINT G1/H1)\n"
            "G1 Z0.0000 F20.5 (SIXPOINT G1/H1)\nG91 Z-6\nG90 G0 Z50\nG0 G90 A0.0000 B0.0000 ");
  EXPECT_EQ(ProvenPost(Plain(), Program(Plain())), "proven");
  const std::string other = Program(WithDirections());
  EXPECT_THAT(other, HasSubstr("; written by a post-processor\nN10 G71 G90 G0 Z100\nN20 T3 M6\nN30 G0 Z50\n"
                               "N40 G0 G90 C1=1.9123 B-40.2468 ; SIXPOINT G1/H1\n"));
  EXPECT_THAT(other, HasSubstr("TRAORI(1)\nN200 ORIWKS ORIVECT\nN210 G1 X"));
  EXPECT_EQ(ProvenPost(WithDirections(), other), "proven");
}

// Within a hole or a path, never across them: another blade's program is the same without the holes that were cut.
TEST(PostProcessor, LeavesOutWhatIsInForce) {
  PostProcessor post = Plain();
  post.leaves_out_repeated = true;
  const std::string program = Program(post);
  EXPECT_THAT(program, HasSubstr("G0 G90 A1.9123 B-40.2468 (SIXPOINT G1/H1)\nX10.1234 Y5.2345 (SIXPOINT G1/H1)\n"
                                 "G1 Z-12.4321 F20.5 (SIXPOINT G1/H1)\nG91 Z-6\nG90 G0 Z50\nG0 G90 A1.9123"));
  // Each pose of a path says its own axes, whatever they are called.
  EXPECT_THAT(program, HasSubstr("\nX21.1234 Y4.4345 Z-11.5321 A25.9123 B-39.6468 (SIXPOINT F1/2)\nX21.6234 "));
  EXPECT_EQ(ProvenPost(post, program), "proven");
  // Z is another one after steps and after a value of the section's own.
  post.hole = "G0 G90 {a} {b} {x} {y}\nG1 {z} F{feed}\nG91 Z-1\nG90 {z}\nG0 Z50\n{z}\n{x}\nZ50";
  EXPECT_THAT(Program(post), HasSubstr("G91 Z-1\nG90 Z-12.4321 (SIXPOINT G1/H1)\nG0 Z50\nZ-12.4321 (SIXPOINT "
                                       "G1/H1)\nX10.1234 (SIXPOINT G1/H1)\nZ50\n"));
}

// Whatever a control wants: what is written is proven, and so is what is left once holes were cut.
TEST(PostProcessor, IsProvenInManyStyles) {
  std::mt19937_64 random(7);
  const auto draw = [&](int least, int most) { return std::uniform_int_distribution<int>(least, most)(random); };
  const auto angle = [&] { return std::uniform_real_distribution<double>(-60, 60)(random); };
  for (int i = 0; i < 300; ++i) {
    PostProcessor post = draw(0, 1) == 0 ? Plain() : WithDirections();
    post.linear_decimals = draw(4, 9);
    post.rotary_decimals = draw(4, 9);
    post.explicit_plus = draw(0, 1) == 1;
    post.leaves_out_repeated = draw(0, 1) == 1;
    post.number_step = draw(0, 1) * draw(1, 1000);
    post.axis_words = draw(0, 1) == 0 ? std::array<std::string, 5>{"X", "Y", "Z", "C1", "B4"}
                                      : std::array<std::string, 5>{"X1", "Y1", "Z1", "U", "W"};
    for (std::string* const section :
         {&post.program_start, &post.operation_start, &post.hole, &post.path_end, &post.program_end, &post.path_start})
      *section = std::regex_replace(*section, std::regex("Z(-|1|5|\\{)"),
                                    post.axis_words[2] + (post.axis_words[2] == "Z1" ? "=$1" : "$1"));
    std::map<std::string, NcTarget> targets = TargetsOfPost();
    const double a_deg = angle(), b_deg = angle();
    // Away from where the first axis would be free: there no direction says its angle.
    const double path_b_deg = std::copysign(10 + std::abs(angle()) / 2, angle());
    const double path_a_deg = angle();
    for (auto& [name, target] : targets) {
      target.a_deg = target.number > 0 ? path_a_deg + target.number : a_deg;
      target.b_deg = target.number > 0 ? path_b_deg + 0.7 * target.number : b_deg;
    }
    const std::string program = Program(post, targets);
    ASSERT_EQ(ProvenPost(post, program, targets), "proven") << program;
    std::set<std::string> cut;
    if (draw(0, 1) == 1) cut.insert(draw(0, 1) == 1 ? "G1/H1" : "G1/H2");
    if (draw(0, 1) == 1)
      for (int k = 1; k <= 4; ++k) cut.insert("F1/" + std::to_string(k));
    const auto left = LeaveOut(program, cut, {'A', 'B'}, FrameOf(post), targets);
    ASSERT_TRUE(left.ok()) << left.status() << "\n" << program;
    for (const std::string& name : cut) targets.erase(name);
    if (targets.empty()) continue;
    EXPECT_EQ(ProvenPost(post, left->program, targets), "proven") << left->program;
  }
}

// A control's own search: the angles at which the tool points so on the part as the block says, nearest to where they stand.
TEST(PostProcessor, DirectionsAreWhatAControlMakesTheTargetsOf) {
  const PostProcessor post = WithDirections();
  const RotaryAxes axes = OfRecord();
  const auto turn = [](const AxisLine& line, double deg, const Eigen::Vector3d& p) -> Eigen::Vector3d {
    // Rodrigues, by hand.
    const Eigen::Vector3d r = p - line.point_mm, k = line.direction;
    const double c = std::cos(deg * kRadPerDeg), s = std::sin(deg * kRadPerDeg);
    return line.point_mm + c * r + s * k.cross(r) + (1 - c) * k.dot(r) * k;
  };
  const auto stands = [&](const Eigen::Vector3d& p, double a, double b) { return turn(axes.a, a, turn(axes.b, b, p)); };
  std::istringstream lines(Program(post));
  std::string line;
  double a = TargetsOfPost().at("F1/1").a_deg, b = TargetsOfPost().at("F1/1").b_deg;
  int found = 0;
  const std::regex pose(
      "X([-.0-9]+) Y([-.0-9]+) Z([-.0-9]+) A3=([-.0-9]+) B3=([-.0-9]+) C3=([-.0-9]+) .*SIXPOINT (F1/[0-9])");
  while (std::getline(lines, line)) {
    std::smatch said;
    if (!std::regex_search(line, said, pose)) continue;
    ++found;
    const Eigen::Vector3d point(std::stod(said[1]), std::stod(said[2]), std::stod(said[3]));
    const Eigen::Vector3d direction(std::stod(said[4]), std::stod(said[5]), std::stod(said[6]));
    EXPECT_NEAR(direction.norm(), 1, 1e-7);
    const auto beside = [&](double at_a, double at_b) {
      return (stands(direction, at_a, at_b) - stands(Eigen::Vector3d::Zero(), at_a, at_b) - Eigen::Vector3d::UnitZ())
          .norm();
    };
    for (double step = 1; step > 1e-10; step /= 2)
      for (bool better = true; better;) {
        better = false;
        for (const auto& [da, db] :
             std::vector<std::pair<double, double>>{{step, 0}, {-step, 0}, {0, step}, {0, -step}})
          if (beside(a + da, b + db) < beside(a, b)) a += da, b += db, better = true;
      }
    const NcTarget& target = TargetsOfPost().at(said[7]);
    EXPECT_NEAR(a, target.a_deg, 1e-5) << line;
    EXPECT_NEAR(b, target.b_deg, 1e-5) << line;
    EXPECT_LT(
        (stands(point, target.a_deg, target.b_deg) - Eigen::Vector3d(target.x_mm, target.y_mm, target.z_mm)).norm(),
        1e-4);
  }
  EXPECT_EQ(found, 3);
}

TEST(PostProcessor, DirectionsAreRefusedWhereAControlMayTakeThemOtherwise) {
  const PostProcessor post = WithDirections();
  const std::string program = Program(post);
  const auto spoilt = [&](const std::string& what, const std::string& by) {
    return ProvenPost(post, With(program, what, by));
  };
  EXPECT_THAT(spoilt("TRAORI(1)", "TRAORI(2)"), HasSubstr("TRAORI(1)"));
  EXPECT_THAT(spoilt("TRAORI(1)", "G0"), HasSubstr("not read"));
  EXPECT_THAT(spoilt("ORIWKS ORIVECT", "ORIVECT"), HasSubstr("ORIWKS before"));
  EXPECT_THAT(spoilt("TRAFOOF", "G90"), HasSubstr("no G0 while TRAORI"));
  EXPECT_THAT(spoilt("ORIWKS ORIVECT", "ORIWKS CYCLE"), HasSubstr("no names"));
  const std::size_t second = program.find("C3=");
  const std::string value = program.substr(second, program.find(' ', second) - second);
  EXPECT_THAT(spoilt(" " + value, ""), HasSubstr("in one block"));
  EXPECT_THAT(spoilt(value, "C3=0.2"), HasSubstr("of length 1"));
  EXPECT_THAT(spoilt(" " + value, " " + value + " B1"), HasSubstr("no rotary axis"));
  EXPECT_THAT(ProvenPost(post, std::regex_replace(program, std::regex("G1 (X[^;]*A3=)"), "G0 $1")),
              HasSubstr("no G0 while"));
  // A point of the part that is another one by 0.01 mm, and a direction that is by 0.001 deg.
  EXPECT_THAT(
      ProvenPost(post, std::regex_replace(program, std::regex("(X[-0-9]+\\.[0-9])[0-9]([0-9]+ Y[-.0-9]+ Z[-.0-9]+ A3)"),
                                          "$01"
                                          "0$2")),
      HasSubstr("cuts away from F1/"));
  EXPECT_THAT(ProvenPost(post, std::regex_replace(program, std::regex("A3=(-?0\\.[0-9]{4})[0-9]"),
                                                  "A3=$01"
                                                  "0")),
              HasSubstr("cuts away from F1/"));
  // Nobody said whose transformation it is.
  NcFrame nobodys = FrameOf(post);
  nobodys.transformation.reset();
  EXPECT_FALSE(ReadNcProgram(program, {'A', 'B'}, nobodys).ok());
  EXPECT_THAT(ReplaceCoordinates(Template(post), TargetsOfPost(), {'A', 'B'}, nobodys).status().message(),
              HasSubstr("TRAORI"));
  // Not from pose to pose, but to a hole.
  PostProcessor to_hole = post;
  to_hole.path_start = With(to_hole.path_start, "\nTRAORI(1)\nORIWKS ORIVECT", "");
  to_hole.path_pose = "TRAORI\nORIWKS\nG1 {x} {y} {z} {v} F{feed}\nTRAFOOF";
  EXPECT_EQ(ProvenPost(to_hole, Program(to_hole)), "proven");
  EXPECT_THAT(ProvenPost(post, With(program, "TRAFOOF", "G1 X1 Y2 Z3 A3=0 B3=0 C3=1 ; SIXPOINT G1/H1")),
              Not(HasSubstr("not proven: not")));
  EXPECT_THAT(ProvenPost(post, With(program, "TRAFOOF", "G1 X1 Y2 Z3 A3=0 B3=0 C3=1 ; SIXPOINT G1/H1")),
              Not(::testing::Eq("proven")));
}

// An axis of the record that is beside the identified one leaves nothing: the commands are the same.
TEST(PostProcessor, AControlOfOtherAxesIsFoundByTheProof) {
  const PostProcessor post = WithDirections();
  const std::string program = Program(post);
  NcFrame other = FrameOf(post);
  other.transformation->b.point_mm.z() += 0.02;
  const auto moves = ReadNcProgram(program, {'A', 'B'}, other);
  ASSERT_TRUE(moves.ok()) << moves.status();
  EXPECT_THAT(ProveProgram(*moves, TargetsOfPost(), RotaryAxes()).status().message(), HasSubstr("cuts away from F1/2"));
}

TEST(PostProcessor, RefusesWhatItCannotHave) {
  const auto refusal = [](const std::function<void(PostProcessor*)>& spoil, const PostProcessor& of = Plain()) {
    PostProcessor post = of;
    spoil(&post);
    return std::string(CheckPostProcessor(post).message());
  };
  EXPECT_EQ(refusal([](PostProcessor*) {}), "");
  for (const auto& [section, wanted] :
       std::vector<std::pair<std::string, std::string>>{{"G0 {q}", "hole line 1: {q}"},
                                                        {"G0 {x", "each { with its }"},
                                                        {"G0 x}", "each { with its }"},
                                                        {"G0 {x} {x}", "once in a line"},
                                                        {"G0 {x} Z50", "hole line 1: Z50, want braces"},
                                                        {"G0 {x} ; go", "comments in lines of their own"},
                                                        {"G0 {number}", "{number}"},
                                                        {"{v}", "a control that has directions"},
                                                        {"(SixPoint G1/H1)", "no marker"},
                                                        {"G0\tX", "printable ASCII"},
                                                        {"G0 {x}\n\xc3\xa4", "hole line 2"}})
    EXPECT_THAT(refusal([&](PostProcessor* post) { post->hole = section; }), HasSubstr(wanted)) << section;
  EXPECT_THAT(refusal([](PostProcessor* post) { post->program_start = "{x}"; }), HasSubstr("no words of a hole"));
  EXPECT_THAT(refusal([](PostProcessor* post) { post->program_end = "{operation}"; }), HasSubstr("{operation}"));
  EXPECT_THAT(refusal([](PostProcessor* post) { post->path_end = std::string(9000, '\n') + "{q}"; }),
              HasSubstr("9003 bytes"));
  EXPECT_THAT(refusal([](PostProcessor* post) { post->linear_decimals = 3; }),
              HasSubstr("linear_decimals: 3, want 4 to 9"));
  EXPECT_THAT(refusal([](PostProcessor* post) { post->number_step = -1; }), HasSubstr("number_step"));
  EXPECT_THAT(refusal([](PostProcessor* post) { post->axis_words[3] = "X"; }), HasSubstr("that no other axis has"));
  for (const char* const word : {"", "G", "F", "a", "AB", "A1234", "C=", "N1"})
    EXPECT_THAT(refusal([&](PostProcessor* post) { post->axis_words[3] = word; }), HasSubstr("axis_words.a")) << word;
  EXPECT_THAT(refusal([](PostProcessor* post) { post->semicolon_comments = false; }, WithDirections()),
              HasSubstr("semicolon"));
  EXPECT_THAT(refusal([](PostProcessor* post) { post->axis_words[3] = "B3"; }, WithDirections()),
              HasSubstr("no word of a direction"));
  EXPECT_THAT(refusal([](PostProcessor* post) { post->path_pose = "G1 {x} {y} {v}"; }, WithDirections()),
              HasSubstr("{x}, {y} and {z}"));
  EXPECT_THAT(refusal([](PostProcessor* post) { post->hole = "G1 {x} {y} {z} {v}"; }, WithDirections()),
              HasSubstr("path_pose alone"));
  EXPECT_THAT(refusal([](PostProcessor* post) { post->hole = "(H {hole})"; }, WithDirections()),
              HasSubstr("no brackets"));

  PostProcessor post = Plain();
  std::vector<PostOperation> operations = Operations();
  operations[0].tool_number.reset();
  EXPECT_THAT(WriteTemplate(post, operations, 1 << 20).status().message(),
              HasSubstr("{tool}, want an operation that states it: OP10"));
  EXPECT_THAT(WriteTemplate(post, Operations(), 300).status().message(), HasSubstr("more than 300 bytes"));
  post.hole.clear();
  EXPECT_THAT(WriteTemplate(post, Operations(), 1 << 20).status().message(),
              HasSubstr("hole: empty, want the blocks of G1/H1"));
}

}  // namespace
}  // namespace sixpoint::metrology
