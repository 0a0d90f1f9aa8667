#!/bin/sh
# Makes docs/accuracy.md of what the tests say about themselves. With RESOLVENT_FULL=1 they run everything. With RESOLVENT_REPORT=DIR it
# makes the page of what an earlier run of tests left there.
set -eu
cd "$(dirname "$0")/.."
if [ -z "${RESOLVENT_REPORT-}" ]; then
    RESOLVENT_REPORT=$(mktemp -d)
    export RESOLVENT_REPORT
    trap 'rm -rf "$RESOLVENT_REPORT"' EXIT
    cargo build --release
    cargo test --release -p resolvent-tests --test physics
    cargo test --release -p resolvent-tests --test cli skips
fi
cores=$(nproc)
machine="$cores-core $(uname -m | tr _ -) $(grep -qw hypervisor /proc/cpuinfo && echo virtual machine || echo machine)"
mkdir -p docs
{
    echo "# Accuracy"
    echo
    echo "Made by \`tests/accuracy.sh\` on $(date +%Y-%m-%d), $machine. Every figure comes from the tests themselves."
    echo
    echo "## Against exact answers"
    echo
    echo "Each test renders scenes whose answer is known in closed form, by quadrature or by a deterministic solver, and judges all of its rows"
    echo "together at the level of 0.1 %: z = (mean − exact)/standard error; χ² is the sum of z² over rows that are independent. *Claims* hold exactly or"
    echo "to a stated rounding."
    echo
    echo "| test | rows | claims | samples | worst \\|z\\| | χ² / rows |"
    echo "|---|---|---|---|---|---|"
    sort "$RESOLVENT_REPORT/physics.md"
    echo
    echo "## What breaks renderers"
    echo
    echo "| row | set-up | held by |"
    echo "|---|---|---|"
    cat "$RESOLVENT_REPORT/stress.md"
    echo
    echo "## What is not there costs nothing"
    echo
    echo "By the program's own counters (\`--stats\`); the same counters are above 0 where the feature is there."
    echo
    echo "| absent | work that is not done |"
    echo "|---|---|"
    cat "$RESOLVENT_REPORT/skips.md"
    echo
    cat tests/long_runs.md
} > docs/accuracy.md
