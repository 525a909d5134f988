#include "core/brachytherapy/dose/dose_seed_file.h"

#include "core/base/number_csv.h"
#include "core/base/number_text.h"
#include "core/brachytherapy/dose/source.h"

namespace brachy {
namespace {

DoseSeed read_seed(std::span<const double> cells, const std::string& name, std::size_t line) {
  const Vec3 axis(cells[3], cells[4], cells[5]);
  const double largest = axis.cwiseAbs().maxCoeff();
  if (largest == 0)
    refuse_line(name, line, "the axis ax,ay,az is 0; give the direction the seed lies along, e.g. 0,0,1");
  const std::optional<SourceModel> source = find_source(exact_text(cells[6]));
  if (!source)
    refuse_line(
        name, line,
        "no source " + exact_text(cells[6]) +
            "; use the number of a source: 6711 (I-125), 200 (Pd-103), 131 (Cs-131), 192 (Ir-192 HDR)");
  if (!(cells[7] > 0))
    refuse_line(name, line,
                "strength_u is " + exact_text(cells[7]) + "; give an air-kerma strength above 0, in U");
  // The axis is divided first: squares of very small or large components under- or overflow.
  return {.position = {cells[0], cells[1], cells[2]},
          .axis = (axis / largest).normalized(),
          .source = *source,
          .air_kerma_strength_u = cells[7]};
}

std::vector<DoseSeed> read_seeds(const NumberTable& table, const std::string& name) {
  std::vector<DoseSeed> seeds;
  for (std::size_t i = 0; i < table.rows(); ++i)
    seeds.push_back(read_seed(table.row(i), name, table.lines[i]));
  return seeds;
}

}  // namespace

std::vector<DoseSeed> parse_dose_seeds(std::string_view text, const std::string& name) {
  return read_seeds(parse_number_csv(text, name, kDoseSeedHeader), name);
}

std::vector<DoseSeed> load_dose_seeds(const std::filesystem::path& file) {
  return read_seeds(load_number_csv(file, kDoseSeedHeader), file.string());
}

std::string to_csv(const std::vector<DoseSeed>& seeds) {
  std::string text = std::string(kDoseSeedHeader) + "\n";
  for (const DoseSeed& seed : seeds) {
    for (const Vec3* v : {&seed.position, &seed.axis})
      for (int k = 0; k < 3; ++k) text += exact_text((*v)[k]) + ",";
    text +=
        std::to_string(tg43_source(seed.source).number) + "," + exact_text(seed.air_kerma_strength_u) + "\n";
  }
  return text;
}

}  // namespace brachy
