#include "server/gaussian_process.h"

#include <numeric>
#include <vector>

#include <opencv2/core.hpp>

namespace fstop::server {

double conditional_mean(std::span<const double> observed, std::span<double> between,
                        std::span<const double> with_point) {
  if (observed.empty()) return 0.0;
  const int n = static_cast<int>(observed.size());
  const cv::Mat covariance(n, n, CV_64F, between.data());
  std::vector<double> values(observed.begin(), observed.end());
  const cv::Mat right(n, 1, CV_64F, values.data());
  cv::Mat weights;
  if (!cv::solve(covariance, right, weights, cv::DECOMP_CHOLESKY)) return 0.0;
  return std::inner_product(with_point.begin(), with_point.end(), weights.ptr<double>(), 0.0);
}

}  // namespace fstop::server
