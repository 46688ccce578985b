#include "io/standard_streams.hpp"
#include "orchestrator/cli/verbs.hpp"
#include "orchestrator/script/memory.hpp"

#include <fmt/format.h>

#include <clocale>
#include <exception>
#include <new>

namespace {

using consort::Exit;

// The only place where exceptions end; every kind has its exit code.
int run(consort::CommandLine& command) {
  try {
    return static_cast<int>(command.execute());
  } catch (const CLI::ParseError& stop) {
    return command.answer(stop);
  } catch (const consort::ConfigError& error) {
    return command.fail(Exit::bad_input, error.what());
  } catch (const consort::TimeoutError& error) {
    return command.fail(Exit::timed_out, error.what());
  } catch (const consort::RunError& error) {
    return command.fail(Exit::run_failed, error.what());
  } catch (const consort::ContractViolation& error) {
    return command.fail(Exit::run_failed, fmt::format("a mistake in Consort itself, please report it: {}", error.what()));
  } catch (const std::bad_alloc&) {
    return command.fail(Exit::bad_input, consort::out_of_memory());
  } catch (const std::exception& error) {
    return command.fail(Exit::run_failed, error.what());
  }
}

}  // namespace

int main(int argc, char** argv) {
  consort::streams::prepare();
  std::setlocale(LC_CTYPE, "");  // decides between ✓ and its plain-text twin; numbers keep their point
  try {
    consort::CommandLine command(argc, argv);
    return consort::streams::concluded("consort", run(command));
  } catch (const std::exception& error) {  // even saying what went wrong has failed
    consort::streams::tell(fmt::format("consort: {}\n", error.what()));
    return static_cast<int>(Exit::run_failed);
  }
}
