// A device driver's use of the installed headers: the force beside the device from one local model.
#include <iostream>
#include "haptics/force/local_force.h"
int main() {
  brachy::LocalContactModel model;  // as LOCAL_MODEL brings it: tissue of 0.5 N/mm that sticks up to 2 N
  model.tick = 1;
  model.in_contact = true;
  model.axial_stiffness_n_per_mm = 0.5;
  model.axial_min_n = -2;
  model.axial_max_n = 2;
  brachy::LocalForce force;
  force.take(model, brachy::LocalForce::kUnknown, 0);
  brachy::Vec3 felt = brachy::Vec3::Zero();
  for (std::int64_t ms = 1; ms <= 20; ++ms) felt = force.evaluate({0, 0, 1}, ms * 1'000'000).force_n;
  std::cout << felt.z() << " N\n";
}
