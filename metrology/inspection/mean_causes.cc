#include "metrology/inspection/mean_causes.h"

#include <limits>
#include <utility>

#include "metrology/linear_algebra/symmetric.h"
#include "metrology/parallel/loops.h"

namespace sixpoint::metrology {

DeviationCauses CausesOf(const PartMapping& mapping, std::size_t mean_count,
                         const std::function<std::vector<MeanPart>(std::size_t mean)>& parts_of, int threads) {
  const RegisteredPose& pose = mapping.pose();
  const auto rows = static_cast<Eigen::Index>(mean_count);
  const auto angle_count = static_cast<Eigen::Index>(pose.angles.size());
  Eigen::MatrixXd inputs = Eigen::MatrixXd::Zero(rows, kMappingInputs),
                  angles = Eigen::MatrixXd::Zero(rows, angle_count);
  ForEach(mean_count, threads, [&](std::size_t mean) {
    for (const MeanPart& part : parts_of(mean)) {
      const Eigen::RowVector3d along = part.share * part.normal.transpose();
      inputs.row(static_cast<Eigen::Index>(mean)) +=
          along * mapping.Sensitivity(part.in_part_mm, part.in_sensor_mm, part.place);
      if (angle_count > 0)
        angles.row(static_cast<Eigen::Index>(mean)) += along * mapping.AngleSensitivity(part.in_part_mm, part.place);
    }
  });
  DeviationCauses causes;
  std::vector<Eigen::MatrixXd> columns;
  Eigen::Index count = 0;
  const auto add = [&](const std::string& source, double degrees_of_freedom, Eigen::MatrixXd per_sigma_mm) {
    causes.causes.push_back({source, degrees_of_freedom, count, per_sigma_mm.cols()});
    count += per_sigma_mm.cols();
    columns.push_back(std::move(per_sigma_mm));
  };
  const double known = std::numeric_limits<double>::infinity();
  add("noise of the scans", known, inputs.leftCols<6>() * FactorOf(pose.noise.values));
  for (const ErrorSource& source : pose.sources)
    add(source.name, source.degrees_of_freedom,
        inputs.leftCols<6>() * source.pose_per_sigma +
            inputs.rightCols<kCalibrationParameterCount>() * source.parameters_per_sigma);
  if (angle_count > 0) add("angles of the scans", known, angles * FactorOf(ErrorCovariance(pose.angles)));
  causes.per_sigma_mm.resize(rows, count);
  for (std::size_t k = 0; k < columns.size(); ++k)
    causes.per_sigma_mm.middleCols(causes.causes[k].first, causes.causes[k].count) = columns[k];
  return causes;
}

}  // namespace sixpoint::metrology
