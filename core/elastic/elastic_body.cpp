#include "core/elastic/elastic_body.h"

#include <algorithm>

namespace brachy {

std::vector<double> ElasticBody::materials() const {
  std::vector<double> k = {1};
  for (const auto& region : regions) k.push_back(region->shear_modulus / shear_modulus);
  return k;
}

void ElasticBody::material_shares(const Vec3& X, std::span<double> shares) const {
  std::ranges::fill(shares, 0);
  double left = 1;
  for (std::size_t r = regions.size(); r > 0 && left > 0; --r) {
    shares[r] = left * regions[r - 1]->inside_share(X);
    left -= shares[r];
  }
  shares[0] = left;
}

double ElasticBody::relative_modulus(const Vec3& X) const {
  double left = 1, modulus = 0;
  for (std::size_t r = regions.size(); r > 0 && left > 0; --r) {
    const double share = left * regions[r - 1]->inside_share(X);
    modulus += share * regions[r - 1]->shear_modulus / shear_modulus;
    left -= share;
  }
  return modulus + left;
}

Vec3 ElasticBody::face_normal(std::size_t f) {
  return (f % 2 ? 1.0 : -1.0) * Vec3::Unit(static_cast<Eigen::Index>(f / 2));
}

Vec3 ElasticBody::face_centre(std::size_t f) const {
  return box_centre + 0.5 * box_size.cwiseProduct(face_normal(f));
}

}  // namespace brachy
