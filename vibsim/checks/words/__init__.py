"""What was found, in words: made from facts when they are asked for, in the notation of who reads them."""
