#include <cmath>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <type_traits>
#include <vector>

#include "apps/command_line/command_line_parts.h"
#include "apps/command_line/output_file.h"
#include "apps/command_line/tool.h"

namespace brachy {

Option Option::required() const {
  option_->required();
  return *this;
}

Option Option::needs(Option other) const {
  option_->needs(other.option_);
  return *this;
}

Option Option::excludes(Option other) const {
  option_->excludes(other.option_);
  return *this;
}

Option Option::show_default() const {
  option_->capture_default_str();
  return *this;
}

Option Option::range(double least, double most) const {
  option_->check(between(least, most));
  return *this;
}

Option Option::range(int least, int most) const {
  option_->check(whole_between(least, most));
  return *this;
}

Option Option::one_of(std::vector<std::string> choices) const {
  option_->check(CLI::IsMember(std::move(choices)));
  return *this;
}

Option Option::comma_separated() const {
  option_->delimiter(',');
  return *this;
}

Option Option::values(int count) const {
  option_->expected(count);
  return *this;
}

Option Option::check(std::function<std::string(const std::string&)> fault, const std::string& form) const {
  option_->check(CLI::Validator([fault = std::move(fault)](std::string& text) { return fault(text); }, form));
  return *this;
}

bool Option::is_given() const {
  return option_->count() > 0;
}

struct OptionList::Files {
  struct Named {
    CLI::Option* option;
    std::function<std::vector<std::filesystem::path>()> paths;  // after parsing
  };
  std::vector<Named> inputs, outputs, folders;
  const bool* force = nullptr;
};

namespace {

std::vector<std::filesystem::path> paths_in(const std::filesystem::path& value) {
  return {value};
}
std::vector<std::filesystem::path> paths_in(const std::optional<std::filesystem::path>& value) {
  return value ? paths_in(*value) : std::vector<std::filesystem::path>();
}
std::vector<std::filesystem::path> paths_in(const std::vector<std::filesystem::path>& value) {
  return value;
}
std::vector<std::filesystem::path> paths_in(const auto&) {
  return {};
}

template <class Value>
constexpr bool kNamesFiles = std::is_same_v<Value, std::filesystem::path> ||
                             std::is_same_v<Value, std::optional<std::filesystem::path>> ||
                             std::is_same_v<Value, std::vector<std::filesystem::path>>;

}  // namespace

OptionList::OptionList(CLI::App& command) : command_(command), files_(std::make_shared<Files>()) {}

template <class T>
Option OptionList::add(const std::string& name, T& value, const std::string& help) {
  CLI::Option* const option = command_.add_option(name, value, help);
  if constexpr (kNamesFiles<T>) files_->inputs.push_back({option, [&value] { return paths_in(value); }});
  return Option(option);
}

template <class T>
Option OptionList::add_output(const std::string& name, T& value, const std::string& help) {
  CLI::Option* const option = command_.add_option(name, value, help)->type_name("NEW FILE");
  files_->outputs.push_back({option, [&value] { return paths_in(value); }});
  return Option(option);
}

template <class T>
Option OptionList::add_output_folder(const std::string& name, T& value, const std::string& help) {
  CLI::Option* const option = command_.add_option(name, value, help)->type_name("NEW FOLDER");
  files_->folders.push_back({option, [&value] { return paths_in(value); }});
  return Option(option);
}

Option OptionList::add_force(bool& value) {
  files_->force = &value;
  return add_flag("--force", value, "overwrite what exists, but never an input");
}

void OptionList::check_outputs() const {
  const auto given = [](const std::vector<Files::Named>& named) {
    std::vector<std::optional<std::filesystem::path>> paths;
    for (const Files::Named& one : named)
      if (one.option->count() > 0)
        for (const std::filesystem::path& path : one.paths()) paths.emplace_back(path);
    return paths;
  };
  const auto inputs = given(files_->inputs), outputs = given(files_->outputs),
             folders = given(files_->folders);
  for (const auto& folder : folders) check_is_no_input(*folder, inputs);
  for (std::size_t i = 0; i < outputs.size(); ++i) {
    check_is_no_input(*outputs[i], inputs);
    for (std::size_t k = 0; k < i; ++k)
      if (std::filesystem::absolute(*outputs[i]).lexically_normal() ==
          std::filesystem::absolute(*outputs[k]).lexically_normal())
        throw UserError(outputs[i]->string() + ": is named for two outputs; give each a name of its own");
    check_output(outputs[i], files_->force != nullptr && *files_->force);
  }
}

using Path = std::filesystem::path;
template Option OptionList::add(const std::string&, std::string&, const std::string&);
template Option OptionList::add(const std::string&, int&, const std::string&);
template Option OptionList::add(const std::string&, std::uint64_t&, const std::string&);
template Option OptionList::add(const std::string&, double&, const std::string&);
template Option OptionList::add(const std::string&, Path&, const std::string&);
template Option OptionList::add(const std::string&, std::optional<int>&, const std::string&);
template Option OptionList::add(const std::string&, std::optional<std::uint32_t>&, const std::string&);
template Option OptionList::add(const std::string&, std::optional<double>&, const std::string&);
template Option OptionList::add(const std::string&, std::optional<Path>&, const std::string&);
template Option OptionList::add(const std::string&, std::vector<double>&, const std::string&);
template Option OptionList::add(const std::string&, std::vector<std::string>&, const std::string&);
template Option OptionList::add(const std::string&, std::vector<Path>&, const std::string&);

template Option OptionList::add_output(const std::string&, Path&, const std::string&);
template Option OptionList::add_output(const std::string&, std::optional<Path>&, const std::string&);
template Option OptionList::add_output_folder(const std::string&, Path&, const std::string&);
template Option OptionList::add_output_folder(const std::string&, std::optional<Path>&, const std::string&);

Option OptionList::add_flag(const std::string& name, bool& value, const std::string& help) {
  return Option(command_.add_flag(name, value, help));
}

Option OptionList::add_text(const std::string& name, std::function<void(const std::string&)> take,
                            const std::string& help) {
  return Option(command_.add_option_function<std::string>(name, take, help));
}

}  // namespace brachy
