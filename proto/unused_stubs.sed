# Takes out of a generated stub what nobody calls: asynchronous calls, and a template for each way to serve each method. Without them
# all stubs of the contract are read in a quarter of a second instead of five (docs/adr/0076).
# The header.
/^  template <class BaseClass>$/,/^  };$/d
/^  typedef /d
/^    std::unique_ptr<.*> (Prepare)?Async[A-Za-z]+\(.*\{$/,/^    \}$/d
/^    (virtual )?::grpc::ClientAsync.*\* (Prepare)?Async[A-Za-z]+Raw\(/d
/^    class async(_interface \{| final :)$/,/^    };$/d
/ async\(\)|class async_interface|class async async_stub_/d
# The source.
/^(void|::grpc::ClientAsync.*\*) [A-Za-z]+::Stub::(async::|(Prepare)?Async).*\{$/,/^}$/d
