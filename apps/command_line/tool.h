#pragma once

#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "apps/command_line/exit_code.h"
#include "core/base/error.h"

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace brachy {

// How a tool of `brachy` declares its options, its help and its run, in one file and without the parser's header: see
// apps/brachy/README.md for the recipe.

/// The options do not fit together: the message, which names the fix, is printed with the tool's name and "Try --help."
/// Exit code 2.
class UsageError : public UserError {
 public:
  using UserError::UserError;
};

/// An option that was added to an OptionList. The functions refine it and return it. Copies mean the same option;
/// valid as long as the list.
class Option {
 public:
  explicit Option(CLI::Option* option) : option_(option) {}

  Option required() const;
  Option needs(Option other) const;               ///< given only together with `other`
  Option excludes(Option other) const;            ///< never given together with `other`
  Option show_default() const;                    ///< the help states the value that the variable has now
  Option range(double least, double most) const;  ///< inclusive; NaN is outside
  Option range(int least, int most) const;        ///< inclusive
  Option one_of(std::vector<std::string> choices) const;
  Option comma_separated() const;  ///< of a list: values are separated by commas
  Option values(int count) const;  ///< of a list: so many values, no fewer and no more
  /// `fault` returns what is wrong with a text, or nothing. `form` is shown in the help, such as "HOST:PORT".
  Option check(std::function<std::string(const std::string&)> fault, const std::string& form) const;

  bool is_given() const;  ///< after parsing

 private:
  CLI::Option* option_;
};

/// The options of one tool. A name without dashes is a positional argument. Variables live as long as the list; they
/// keep their value where the option is not given.
class OptionList {
 public:
  explicit OptionList(CLI::App& command);

  /// T: std::string, int, std::uint64_t, double, std::filesystem::path, std::optional of int, std::uint32_t, double
  /// or a path, std::vector of double, std::string or paths.
  template <class T>
  Option add(const std::string& name, T& value, const std::string& help);
  /// A file that the tool writes; the help calls it NEW FILE. Before the tool runs, one that exists is refused unless
  /// add_force()'s flag is given, as is one that another option names, to be read or written, whatever its name there.
  /// T: a path or an optional one.
  template <class T>
  Option add_output(const std::string& name, T& value, const std::string& help);
  /// A folder that the tool writes into, NEW FOLDER in the help, which is never an input. What may be in it the tool
  /// says and checks.
  template <class T>
  Option add_output_folder(const std::string& name, T& value, const std::string& help);
  /// --force, for a tool whose outputs may be overwritten.
  Option add_force(bool& value);
  Option add_flag(const std::string& name, bool& value, const std::string& help);
  /// An option whose text `take` converts; called once, after its checks.
  Option add_text(const std::string& name, std::function<void(const std::string&)> take,
                  const std::string& help);

  /// The check that add_output() speaks of, with what was parsed. Throws UserError.
  void check_outputs() const;

 private:
  struct Files;  // what options name
  CLI::App& command_;
  std::shared_ptr<Files> files_;
};

/// A command of a program.
struct Tool {
  std::string name;     ///< as it is called
  std::string summary;  ///< one line, in the program's help too
  std::string details;  ///< below the options in the tool's help: examples, formats, exit codes
  /// Adds the options to the list and returns the run with them, which returns an ExitCode and throws UserError for bad
  /// input. None: another program's command, which is only listed in the help.
  std::function<std::function<int()>(OptionList&)> declare;
};

/// A tool from plain functions: `declare` adds the options with Options' values as defaults, `run` gets what was given.
template <class Options>
Tool make_tool(std::string name, std::string summary, std::string details,
               void (*declare)(OptionList&, Options&), int (*run)(const Options&)) {
  return {std::move(name), std::move(summary), std::move(details),
          [declare, run](OptionList& list) -> std::function<int()> {
            auto options = std::make_shared<Options>();
            declare(list, *options);
            return [options, run] { return run(*options); };
          }};
}

/// Parses the command line of a program with these tools and runs the one that was called; --help and --version too.
/// Returns the exit code. Exceptions are printed: UserError is kExitBadInput, any other kExitFailed.
int run_tools(const std::string& program, const std::string& summary, std::span<const Tool> tools, int argc,
              char** argv);

}  // namespace brachy
