// veneer-worker: does one piece of work for veneerd in a process of its own, and ends. Not started by hand.
#include "daemon/orders/every_work.h"
#include "daemon/workers/work_server.h"

int main() { veneer::daemon::serve_work(veneer::daemon::do_any_work); }
