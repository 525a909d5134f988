#include "core/simulation/organ_tests.h"

#include <gtest/gtest.h>

#include "tests/core/simulation/tick_parts.h"

namespace brachy {
namespace {

using test::TickParts;

std::size_t organ(const SimulationModel& model, const std::string& name) {
  const auto names = names_of(model.organs);
  return static_cast<std::size_t>(std::ranges::find(names, name) - names.begin());
}

// The urethra's axis is at x = 0, y = −4 (load_structures.h): a needle there is in it, one beside it is not.
TEST(OrganTests, EachNeedleHasItsOwnContactWithEachOrgan) {
  Scene scene = TickParts::small_phantom();
  scene.needle.count = 2;
  TickParts parts(scene);
  OrganTests organs(*parts.model);
  const std::size_t count = parts.model->organs.size(), urethra = organ(*parts.model, "urethra");
  ASSERT_LT(urethra, count);
  ASSERT_EQ(organs.contacts().size(), 2 * count);
  for (double z = -45; z <= 3; z += 0.25) {
    parts.step({{0, -4, z}, {12, -4, z}});
    parts.instruments.find_shapes();
    organs.update(parts.tick, parts.instruments, parts.body.frame());
  }
  EXPECT_TRUE(organs.contacts()[urethra].is_in);
  EXPECT_EQ(organs.contacts()[urethra].passes, 1u);
  EXPECT_FALSE(organs.contacts()[count + urethra].is_in);

  // A needle that is taken away ends its pass.
  parts.step({});
  organs.update(parts.tick, parts.instruments, parts.body.frame());
  EXPECT_FALSE(organs.contacts()[urethra].is_in);
  EXPECT_EQ(organs.contacts()[urethra].passes, 1u);
}

}  // namespace
}  // namespace brachy
