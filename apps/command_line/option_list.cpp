#include <cmath>
#include <cstdint>
#include <filesystem>
#include <optional>

#include "apps/command_line/command_line_parts.h"
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

template <class T>
Option OptionList::add(const std::string& name, T& value, const std::string& help) {
  return Option(command_.add_option(name, value, help));
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

Option OptionList::add_flag(const std::string& name, bool& value, const std::string& help) {
  return Option(command_.add_flag(name, value, help));
}

Option OptionList::add_text(const std::string& name, std::function<void(const std::string&)> take,
                            const std::string& help) {
  return Option(command_.add_option_function<std::string>(name, take, help));
}

}  // namespace brachy
