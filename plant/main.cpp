#include "core/errors.hpp"

#include <CLI/CLI.hpp>

#include <cstdio>

int main(int argc, char** argv) {
  CLI::App app(
      "The plant process of a Consort run: the physics between actuation and measurement. The protocols of this version exchange\n"
      "information only, so no experiment starts it yet; `consort list protocols` says what each needs.",
      "consort-plant");
  app.set_version_flag("--version", CONSORT_VERSION);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& failure) {
    return app.exit(failure) == 0 ? 0 : static_cast<int>(consort::Exit::bad_input);
  }
  std::fputs("consort-plant: no experiment of this version has a plant; start agents with `consort run FILE`\n", stderr);
  return static_cast<int>(consort::Exit::bad_input);
}
