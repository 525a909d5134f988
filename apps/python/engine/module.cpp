// The Python module brachyd_engine: numpy arrays to poses, and a state's memory to numpy. The typed class that
// users see is apps/python/brachyd/simulator.py.
#include <fmt/format.h>
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <cmath>
#include <filesystem>

#include "apps/python/engine/engine.h"
#include "apps/python/engine/observation.h"
#include "apps/python/engine/pose_arrays.h"
#include "core/base/error.h"
#include "core/base/version.h"
#include "core/scene/choice/choice.h"
#include "core/scene/file/scene_file.h"

namespace brachy {
namespace {

namespace py = pybind11;
using Numbers = py::array_t<double, py::array::c_style | py::array::forcecast>;
using Flags = py::array_t<bool, py::array::c_style | py::array::forcecast>;

/// An array of the module's own memory, which stays where it is as long as `owner` lives; not to be written.
template <class T>
py::array view_of(const T* data, py::ssize_t rows, const py::object& owner) {
  py::array_t<T> view({rows, py::ssize_t{3}}, data, owner);
  py::detail::array_proxy(view.ptr())->flags &= ~py::detail::npy_api::NPY_ARRAY_WRITEABLE_;
  return view;
}

py::array_t<double> array_of(const Vec3& v) {
  return py::array_t<double>(3, v.data());
}
py::array_t<double> array_of(const std::vector<double>& values) {
  return py::array_t<double>(static_cast<py::ssize_t>(values.size()), values.data());
}
/// Of an array n×3.
std::vector<Vec3> points_of(const Numbers& points) {
  if (points.ndim() != 2 || points.shape(1) != 3) throw py::value_error("points are an array n×3, mm");
  std::vector<Vec3> all;
  for (py::ssize_t i = 0; i < points.shape(0); ++i)
    all.emplace_back(points.at(i, 0), points.at(i, 1), points.at(i, 2));
  return all;
}
py::array_t<double> array_of(const RigidTransform& X) {
  py::array_t<double> matrix({4, 4});
  auto m = matrix.mutable_unchecked<2>();
  for (int row = 0; row < 4; ++row)
    for (int column = 0; column < 4; ++column)
      m(row, column) = row == 3 ? (column == 3) : column == 3 ? X.p[row] : X.R(row, column);
  return matrix;
}

/// What Simulator.run() keeps of each tick. Numbers of instruments that are not there are NaN.
struct Columns {
  Columns(py::ssize_t t, py::ssize_t n)
      : force_n({t, n, py::ssize_t{3}}),
        tip_mm({t, n, py::ssize_t{3}}),
        axial_n({t, n}),
        lateral_n({t, n}),
        tip_depth_mm({t, n}),
        contact({t, n}),
        verdict(t),
        det_bound(t),
        max_displacement_mm(t) {}

  py::array_t<double> force_n, tip_mm, axial_n, lateral_n, tip_depth_mm;
  py::array_t<std::uint8_t> contact;
  py::array_t<std::uint8_t> verdict;
  py::array_t<double> det_bound, max_displacement_mm;
};

/// The columns' memory: what is written while other Python threads run.
struct ColumnWriter {
  explicit ColumnWriter(Columns& c)
      : force_n(c.force_n.mutable_data()),
        tip_mm(c.tip_mm.mutable_data()),
        axial_n(c.axial_n.mutable_data()),
        lateral_n(c.lateral_n.mutable_data()),
        tip_depth_mm(c.tip_depth_mm.mutable_data()),
        contact(c.contact.mutable_data()),
        verdict(c.verdict.mutable_data()),
        det_bound(c.det_bound.mutable_data()),
        max_displacement_mm(c.max_displacement_mm.mutable_data()) {}

  void add(const MeshState& state) noexcept {
    const auto put = [](double*& to, const Vec3& v) {
      for (int i = 0; i < 3; ++i) *to++ = v[i];
    };
    for (const NeedleState& needle : state.needles.states) {
      const bool is_there = needle.present;
      const Vec3 none = Vec3::Constant(NAN);
      put(force_n, is_there ? needle.forces.force_n : none);
      put(tip_mm, !is_there ? none : needle.shape.is_bent ? needle.shape.points.back() : needle.X_WN.p);
      *axial_n++ = is_there ? needle.forces.axial_n : NAN;
      *lateral_n++ = is_there ? needle.forces.lateral_n : NAN;
      *tip_depth_mm++ = is_there ? needle.tip_depth_mm : NAN;
      *contact++ = static_cast<std::uint8_t>(needle.contact);
    }
    *verdict++ = static_cast<std::uint8_t>(state.summary.certificate.verdict);
    *det_bound++ = state.summary.certificate.det_bound;
    *max_displacement_mm++ = state.summary.max_displacement_mm;
  }

  double *force_n, *tip_mm, *axial_n, *lateral_n, *tip_depth_mm;
  std::uint8_t *contact, *verdict;
  double *det_bound, *max_displacement_mm;
};

/// An Engine as Python sees it. Python's lock guards `is_stepping`: it is held wherever that is read or written.
class PyEngine {
 public:
  PyEngine(const std::optional<std::filesystem::path>& file, const std::optional<std::string>& text,
           bool with_hash, const std::optional<int>& threads, const std::string& simd) {
    if (file && text) throw UserError("a scene comes from a file or from text, not from both");
    const py::gil_scoped_release others;
    Scene scene = file ? load_scene(*file) : text ? parse_scene(*text, "scene") : Scene{};
    if (threads) scene.engine.threads = *threads;
    if (!simd.empty()) scene.engine.simd = simd;
    engine_ = std::make_unique<Engine>(with_choice(scene), with_hash);
  }
  PyEngine(const PyEngine& like, bool with_hash)
      : engine_(std::make_unique<Engine>(*like.engine_, with_hash)) {}

  /// Poses t×n×(3|4)×4 and buttons t×n, or none. With `columns` a row for each tick.
  void run(const Numbers& poses, const std::optional<Flags>& buttons, ColumnWriter* columns) {
    const Busy busy(*this);
    const auto ticks = poses.shape(0), count = poses.shape(1), size = poses.shape(2) * poses.shape(3);
    const auto entries = static_cast<std::size_t>(ticks * count);
    std::vector<NeedlePose> checked(entries);
    std::string error;
    const std::span<const double> numbers(poses.data(), static_cast<std::size_t>(poses.size()));
    for (std::size_t i = 0; i < entries; ++i) {
      const auto width = static_cast<std::size_t>(size);
      checked[i] = pose_of(numbers.subspan(width * i, width), error);
      if (!error.empty())
        throw py::value_error(fmt::format("the pose of needle {} in row {} {}",
                                          i % static_cast<std::size_t>(count),
                                          i / static_cast<std::size_t>(count), error));
      if (buttons) checked[i].button = checked[i].present && buttons->data()[i];
      checked[i].sequence = ++sequence_;
    }
    const py::gil_scoped_release others;
    for (std::size_t t = 0; t < static_cast<std::size_t>(ticks); ++t) {
      engine_->step(
          std::span(checked).subspan(t * static_cast<std::size_t>(count), static_cast<std::size_t>(count)));
      if (columns) columns->add(engine_->state());
    }
  }

  void step(const Numbers& poses, const std::optional<Flags>& buttons) {
    check_shapes(poses, buttons);
    run(poses, buttons, nullptr);
  }

  py::dict run_rows(const Numbers& poses, const std::optional<Flags>& buttons) {
    check_shapes(poses, buttons);
    Columns columns(poses.shape(0), static_cast<py::ssize_t>(engine_->instrument_count()));
    ColumnWriter writer(columns);
    run(poses, buttons, &writer);
    py::dict rows;
    rows["force_n"] = columns.force_n;
    rows["tip_mm"] = columns.tip_mm;
    rows["axial_n"] = columns.axial_n;
    rows["lateral_n"] = columns.lateral_n;
    rows["tip_depth_mm"] = columns.tip_depth_mm;
    rows["contact"] = columns.contact;
    rows["verdict"] = columns.verdict;
    rows["det_bound"] = columns.det_bound;
    rows["max_displacement_mm"] = columns.max_displacement_mm;
    return rows;
  }

  void reset() {
    const Busy busy(*this);
    sequence_ = 0;
    engine_->reset();
  }

  py::list dose() {
    const Busy busy(*this);
    py::list all;
    for (const StructureDose& d : engine_->dose())
      all.append(py::make_tuple(
          d.name, d.volume_cc, d.mean_gy, d.min_gy, d.max_gy, d.v100_percent, d.v150_percent, d.v200_percent,
          d.v100_cc, d.d90_gy, d.d30_gy, d.d10_gy, d.d2cc_gy,
          py::array_t<float>(static_cast<py::ssize_t>(d.volume_share.size()), d.volume_share.data())));
    return all;
  }

  py::array_t<double> dose_at(const Numbers& points) {
    const Busy busy(*this);
    return array_of(engine_->dose_at(points_of(points)));
  }

  py::dict depths_of(const Numbers& points) const {
    py::dict all;
    for (const auto& [name, depths] : engine_->depths_of(points_of(points)))
      all[py::str(name)] = array_of(depths);
    return all;
  }

  /// Into `out`, so that a loop of ticks allocates nothing.
  void observe(std::size_t id, py::array_t<double, py::array::c_style>& out) const {
    if (out.ndim() != 1 || out.shape(0) != static_cast<py::ssize_t>(kObservationSize))
      throw py::value_error(fmt::format("an observation has {} numbers", kObservationSize));
    if (id >= engine_->instrument_count())
      throw py::index_error(fmt::format("needle {}, and the scene has {}", id, engine_->instrument_count()));
    const Engine& engine = *engine_;
    write_observation(engine.state(), engine.simulator(), id,
                      std::span<double, kObservationSize>(out.mutable_data(), kObservationSize));
  }

  py::tuple needle(std::size_t id) const {
    const NeedleState& n = engine_->state().needles.states.at(id);
    const NeedleForces& f = n.forces;
    py::object shape = py::none();
    if (n.shape.is_bent) {
      py::array_t<float> points({NeedleShape::kPoints, std::size_t{3}});
      auto p = points.mutable_unchecked<2>();
      for (std::size_t i = 0; i < NeedleShape::kPoints; ++i)
        for (int k = 0; k < 3; ++k)
          p(static_cast<py::ssize_t>(i), k) = static_cast<float>(n.shape.points[i][k]);
      shape = points;
    }
    return py::make_tuple(
        static_cast<int>(n.contact), n.present, n.landmark_count, n.puncture_count, n.insertion_depth_mm,
        array_of(n.X_WN),
        py::make_tuple(array_of(f.force_n), array_of(f.tip_torque_nmm), array_of(f.hub_torque_nmm), f.axial_n,
                       f.lateral_n, f.cutting_n, f.friction_n),
        n.input.sequence, n.tip_depth_mm, shape);
  }

  py::tuple drops(std::size_t id) const {
    const DropCounts& d = engine_->state().needles.states.at(id).drops;
    return py::make_tuple(d.dropped, d.refused, std::string(to_string(d.last_refusal)));
  }

  py::list seeds() const {
    py::list all;
    for (const Seed& s : engine_->state().seeds.in_tissue())
      all.append(py::make_tuple(s.id, s.planned, s.needle, static_cast<int>(s.source), s.is_certified, s.tick,
                                s.t_s, s.air_kerma_strength_u, array_of(s.dropped), array_of(s.dropped_axis),
                                array_of(s.rest), array_of(s.rest_axis), array_of(s.gland_motion),
                                array_of(s.position), array_of(s.axis)));
    return all;
  }

  py::tuple certificate() const {
    const Certificate& c = engine_->state().summary.certificate;
    return py::make_tuple(static_cast<int>(c.verdict), c.substeps, c.det_bound, c.vertex_det,
                          array_of(c.place), c.margin_mm, c.held_mm, c.held_n, c.condition);
  }

  py::list plan() const {
    py::list all;
    const SimulationModel& model = *engine_->simulator().model();
    if (!model.plan) return all;
    for (const PlannedSeed& seed : model.plan->seeds(model.settings.template_grid))
      all.append(py::make_tuple(seed.needle, array_of(seed.position)));
    return all;
  }

  const Engine& engine() const { return *engine_; }

 private:
  class Busy {
   public:
    explicit Busy(PyEngine& owner) : owner_(owner) {
      if (owner_.is_stepping_) throw std::runtime_error("another thread is stepping this simulator");
      owner_.is_stepping_ = true;
    }
    ~Busy() { owner_.is_stepping_ = false; }
    Busy(const Busy&) = delete;
    Busy& operator=(const Busy&) = delete;

   private:
    PyEngine& owner_;
  };

  void check_shapes(const Numbers& poses, const std::optional<Flags>& buttons) const {
    if (poses.ndim() != 4 || (poses.shape(2) != 3 && poses.shape(2) != 4) || poses.shape(3) != 4)
      throw py::value_error("poses are arrays of 3×4 or 4×4, mm");
    const auto most = static_cast<py::ssize_t>(engine_->instrument_count());
    if (poses.shape(1) > most)
      throw py::value_error(fmt::format("poses of {} needles, and the scene has {}", poses.shape(1), most));
    if (buttons &&
        (buttons->ndim() != 2 || buttons->shape(0) != poses.shape(0) || buttons->shape(1) != poses.shape(1)))
      throw py::value_error("buttons are as many as poses");
  }

  std::unique_ptr<Engine> engine_;
  std::uint64_t sequence_ = 0;
  bool is_stepping_ = false;
};

template <class T>
py::ssize_t size_of(const std::vector<T>& values) {
  return static_cast<py::ssize_t>(values.size());
}

/// (name, number of numbers) of an observation's parts, in their order.
py::tuple observation_fields() {
  py::list fields;
  for (const ObservationField& field : kObservationFields)
    fields.append(py::make_tuple(std::string(field.name), field.size));
  return py::tuple(fields);
}

void define_engine(py::module_& module) {
  const auto summary = [](const PyEngine& e) -> const TickSummary& { return e.engine().state().summary; };
  py::class_<PyEngine>(module, "Engine")
      .def(py::init<const std::optional<std::filesystem::path>&, const std::optional<std::string>&, bool,
                    const std::optional<int>&, const std::string&>(),
           py::kw_only(), py::arg("file") = py::none(), py::arg("text") = py::none(),
           py::arg("with_hash") = false, py::arg("threads") = py::none(), py::arg("simd") = "")
      .def(py::init<const PyEngine&, bool>(), py::kw_only(), py::arg("like"), py::arg("with_hash") = false)
      .def("reset", &PyEngine::reset)
      .def("step", &PyEngine::step, py::arg("poses"), py::arg("buttons") = py::none())
      .def("run", &PyEngine::run_rows, py::arg("poses"), py::arg("buttons") = py::none())
      .def("dose", &PyEngine::dose)
      .def("dose_at", &PyEngine::dose_at, py::arg("points"))
      .def("depths_of", &PyEngine::depths_of, py::arg("points"))
      .def("observe", &PyEngine::observe, py::arg("id"), py::arg("out").noconvert())
      .def("needle", &PyEngine::needle, py::arg("id"))
      .def("drops", &PyEngine::drops, py::arg("id"))
      .def("seeds", &PyEngine::seeds)
      .def("certificate", &PyEngine::certificate)
      .def("plan", &PyEngine::plan)
      .def_property_readonly("needle_count", [](const PyEngine& e) { return e.engine().instrument_count(); })
      .def_property_readonly("tick", [summary](const PyEngine& e) { return summary(e).tick; })
      .def_property_readonly("sim_time_s", [summary](const PyEngine& e) { return summary(e).sim_time_s; })
      .def_property_readonly("period_s", [](const PyEngine& e) { return e.engine().simulator().period_s(); })
      .def_property_readonly("step_flags", [summary](const PyEngine& e) { return summary(e).step_flags; })
      .def_property_readonly("max_displacement_mm",
                             [summary](const PyEngine& e) { return summary(e).max_displacement_mm; })
      .def_property_readonly("state_hash", [](const PyEngine& e) { return e.engine().hash(); })
      .def_property_readonly("surface_vertex_count",
                             [](const PyEngine& e) { return e.engine().simulator().tissue().surface_count; })
      .def_property_readonly("positions",
                             [](const py::object& self) {
                               const auto& x =
                                   self.cast<const PyEngine&>().engine().state().mesh.deformed_vertices;
                               return view_of(x.data(), size_of(x) / 3, self);
                             })
      .def_property_readonly("rest_positions",
                             [](const py::object& self) {
                               const auto& x = self.cast<const PyEngine&>().engine().rest_positions();
                               return view_of(x.data(), size_of(x) / 3, self);
                             })
      .def_property_readonly("triangles", [](const py::object& self) {
        const auto& all = self.cast<const PyEngine&>().engine().simulator().tissue().triangles;
        static_assert(sizeof(Triangle) == 3 * sizeof(std::uint32_t));
        return view_of(all.front().data(), size_of(all), self);
      });
}

}  // namespace
}  // namespace brachy

PYBIND11_MODULE(brachyd_engine, module) {
  module.doc() = "The engine of brachyd, for apps/python/brachyd/simulator.py.";
  module.attr("__version__") = brachy::version();
  pybind11::register_exception<brachy::UserError>(module, "SceneError", PyExc_ValueError);
  module.attr("OBSERVATION_FIELDS") = brachy::observation_fields();
  brachy::define_engine(module);
}
