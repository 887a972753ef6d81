"""Who could have avoided a contact: backward reachability with stated limits."""
