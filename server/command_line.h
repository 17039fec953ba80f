#pragma once

namespace fstop::server {

/// `fstop COMMAND ...`. Results go to standard output, the log to standard error. A refusal is
/// printed as a problem document; the exit code is 0, 2 for a bad request or 1 for a failure.
int run_command_line(int argc, char** argv);

}  // namespace fstop::server
