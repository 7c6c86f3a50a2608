#include "cli/register_options.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "cli/reports.h"

namespace sixpoint::cli {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

TEST(RegionOf, ReadsBoxesBallsAndHoleGroups) {
  const auto box = RegionOf("box:1,-2,3:-1.5,2,-3");
  ASSERT_TRUE(box.ok()) << box.status();
  EXPECT_EQ(box->box().minimum_mm().x_mm(), -1.5);  // corners in any order
  EXPECT_EQ(box->box().maximum_mm().x_mm(), 1);
  EXPECT_EQ(box->box().minimum_mm().z_mm(), -3);
  const auto ball = RegionOf("ball:1,2,3:4.5");
  ASSERT_TRUE(ball.ok());
  EXPECT_EQ(ball->ball().centre_mm().y_mm(), 2);
  EXPECT_EQ(ball->ball().radius_mm(), 4.5);
  const auto holes = RegionOf("holes:G2:3");
  ASSERT_TRUE(holes.ok());
  EXPECT_EQ(holes->hole_group().group(), "G2");
  EXPECT_EQ(holes->hole_group().margin_mm(), 3);
  for (const char* text :
       {"", "box", "box:1,2:3,4,5", "ball:1,2,3", "ball:1,2,3:x", "holes::3", "holes:G2:", "cone:1:2"})
    EXPECT_THAT(std::string(RegionOf(text).status().message()), HasSubstr("want box:X,Y,Z")) << text;
}

TEST(AddRegisterOptions, ReadsACommandLine) {
  CommandLine line;
  RegisterOptions options;
  AddRegisterOptions(line.root(), &options);
  const std::string wrong = line.Parse(
      "--free turn-x,shift-z --in box:0,0,0:1,1,1 --in holes:G1:2 --not-in ball:0,0,0:5 --weights 1,0.5 --coarse "
      "--least-stock-mm -0.2 --least-points 7");
  ASSERT_EQ(wrong, "");
  const auto fit = FitOptionsOf(options);
  ASSERT_TRUE(fit.ok()) << fit.status();
  ASSERT_EQ(fit->degrees_of_freedom_size(), 2);
  EXPECT_EQ(fit->degrees_of_freedom(0), registration::v1::FREEDOM_TURN_X);
  EXPECT_EQ(fit->degrees_of_freedom(1), registration::v1::FREEDOM_SHIFT_Z);
  EXPECT_EQ(fit->regions_in_size(), 2);
  EXPECT_EQ(fit->regions_out_size(), 1);
  EXPECT_EQ(fit->scan_weights(1), 0.5);
  EXPECT_TRUE(fit->coarse_start());
  EXPECT_EQ(fit->allowance().least_stock_mm(), -0.2);
  EXPECT_EQ(fit->allowance().least_points(), 7);
  EXPECT_FALSE(fit->allowance().has_patch_mm());
  EXPECT_EQ(FitOptionsOf({})->ByteSizeLong(), 0u);
  EXPECT_THAT(line.Parse("--free turn-w"), HasSubstr("turn-w"));
}

TEST(RegisterMethodOf, KnowsEachThatItOffers) {
  for (const std::string& method : RegisterMethods()) EXPECT_EQ(MethodText(RegisterMethodOf(method)), method);
}

TEST(RegistrationText, ShowsWhereThePartIsHowWellAndWhatSpeaksAgainstIt) {
  registration::v1::Registration registration;
  registration.set_name("registrations/r1");
  registration.set_blade("blades/SN-1");
  registration.set_method(registration::v1::METHOD_SIX_POINT);
  for (int i = 0; i < 9; ++i) registration.mutable_zero_from_part()->add_rotation(i % 4 == 0);
  registration.mutable_zero_from_part()->mutable_translation_mm()->set_x_mm(12.5);
  for (int i = 0; i < 36; ++i) {
    registration.mutable_covariance()->add_values(i % 7 != 0 ? 0 : i < 21 ? 1e-10 : 4e-6);
    registration.mutable_noise_covariance()->add_values(0);
  }
  auto& evidence = *registration.mutable_evidence();
  evidence.set_outcome(registration::v1::OUTCOME_CONVERGED);
  evidence.set_remark("something to say");
  evidence.set_weakest_direction_in_words("shift along the part's z");
  evidence.set_weakest_standard_uncertainty_um(1.25);
  auto& agreement = *evidence.add_agreements();
  agreement.set_scan("scans/a");
  agreement.set_other_scan("scans/b");
  agreement.set_difference_rms_um(3);
  agreement.set_expected_rms_um(2);
  evidence.add_regions()->set_mean_um(-4.25);
  evidence.mutable_disagreement()->set_greatest_um(45.5);
  evidence.mutable_disagreement()->set_beyond(true);
  const std::string text = RegistrationText(registration);
  EXPECT_THAT(text, HasSubstr("remark: something to say"));
  EXPECT_THAT(text, HasSubstr("weakest direction: shift along the part's z, standard uncertainty 1.250 um"));
  EXPECT_THAT(text, HasSubstr("DISAGREES with the best fit of the same scans: 45.50 um"));
  EXPECT_THAT(text, HasSubstr("1.50"));      // the agreement's ratio
  EXPECT_THAT(text, HasSubstr("-4.25"));     // the region's mean
  EXPECT_THAT(text, HasSubstr("2.000"));     // um, along the axes: the root of 4e-6 mm^2
  EXPECT_THAT(text, HasSubstr("0.000573"));  // deg, about them: the root of 1e-10 rad^2
  EXPECT_THAT(text, Not(HasSubstr("least stock")));
  evidence.mutable_allowance()->set_lacking_mm(0.25);
  evidence.mutable_allowance()->add_holding()->set_share(0.4);
  EXPECT_THAT(RegistrationText(registration), HasSubstr("least stock 0.0000 mm, 0.2500 mm are lacking"));
  EXPECT_THAT(RegistrationText(registration), HasSubstr("40.0"));
}

}  // namespace
}  // namespace sixpoint::cli
