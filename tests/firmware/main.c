#include "bench.h"

int main(int argc, char *argv[])
{
    CHECK(argc == 2);
    test_lines();
    test_vectors(argv[1]);
    test_session();
    test_motion();
    test_light();
    test_safety();
    test_events();
    test_parameters();
    puts("firmware tests passed");
    return 0;
}
