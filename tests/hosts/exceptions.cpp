// habitus.hpp in a program of two files, one compiled with exceptions and one without: each keeps its own way to fail.
//
//     c++ -c exceptions.cpp -o with.o;  c++ -c -fno-exceptions exceptions.cpp -o without.o
//     c++ with.o without.o libhabitus.a, and the other way round
//
// Without optimisation, so that the linker chooses among the functions that both files contain.
#include <habitus.hpp>

int value_without_exceptions(habitus::result<int> given);
void done_without_exceptions(const habitus::result<void>& given);

#if !defined(__cpp_exceptions)

int value_without_exceptions(habitus::result<int> given) {
    const auto& constant = given;
    return given.value() + constant.value() + std::move(given).value();
}

void done_without_exceptions(const habitus::result<void>& given) { given.value(); }

#else

#include <csignal>
#include <cstdio>

namespace {

/// Whether each value() of this file throws where there is no value.
int thrown(habitus::result<int> bad) {
    const auto& constant = bad;
    int count = 0;
    for (int which = 0; which < 4; ++which) {
        try {
            switch (which) {
            case 0: bad.value(); break;
            case 1: constant.value(); break;
            case 2: std::move(bad).value(); break;
            default: habitus::result<void>(bad.error()).value();
            }
        } catch (const habitus::exception& exception) {
            count += exception.reason() == HAB_EMPTY ? 1 : 0;
        }
    }
    return count;
}

extern "C" void ended(int) {
    std::puts("4 functions throw, and end the program where exceptions are off");
    std::fflush(stdout);
    std::_Exit(0);
}

} // namespace

int main() {
    const habitus::result<int> bad = habitus::error(HAB_EMPTY);
    if (value_without_exceptions(1) != 3) {
        return 1;
    }
    done_without_exceptions({});
    if (thrown(bad) != 4) {
        std::puts("with exceptions value() does not throw");
        return 1;
    }
    std::signal(SIGABRT, ended);
    try {
        value_without_exceptions(bad);
    } catch (...) {
        std::puts("without exceptions value() throws");
    }
    return 1;
}

#endif
