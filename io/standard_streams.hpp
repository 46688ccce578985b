#pragma once
/// The one place where the programs write to standard output and standard error. A stream that cannot be written never ends a program.

#include <string>
#include <string_view>

namespace consort::streams {

/// At the beginning of a program: takes the descriptors 0 to 2 where nobody gave them, so that no file or socket gets their numbers, and
/// makes a reader that is gone, and a limit on the size of files, errors of the write instead of signals that kill.
void prepare();
/// Standard output: what the user asked for. After the first failure nothing more is written.
void put(std::string_view text);
/// Standard error: progress and mistakes. What cannot be written is dropped, as there is nobody to tell.
void tell(std::string_view text);
/// Why something that was put is lost; empty: nothing is.
[[nodiscard]] const std::string& lost();
/// The exit code of a program that would end with `code`: Exit::run_failed where what it put is lost and it had not failed anyhow. Tells
/// why.
[[nodiscard]] int concluded(std::string_view program, int code);

}  // namespace consort::streams
